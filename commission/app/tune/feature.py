"""The step Tune: every parameter of the localizer."""

from __future__ import annotations

from commission.app.base.feature import TUNE, Docked, Feature
from commission.app.tune import reducer
from commission.app.tune.tune_panel import TunePanel

FEATURE = Feature(
    name="tune",
    reducers=(reducer,),
    panels=(Docked(make=lambda at: TunePanel(at.gui, at.post, at.state), tab=TUNE),),
)
