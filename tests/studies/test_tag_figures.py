"""Figures of tags in a run's summary, counted by hand, and what is said where none of them counts."""

# pyright: basic

import dataclasses

import numpy as np
import pytest

from commission.localization.estimate import Belief
from commission.localization.setup import LocalizerSetup
from commission.localization.tags import NIS
from commission.localization.whole_run import run
from commission.site.record_log import RecordLog
from commission.site.records import Detections, Odometry, TagSightings
from commission.site.reflectors import Reflector, ReflectorMap
from commission.studies.consistency import consistency
from commission.studies.tag_figures import tag_figures, tag_findings
from tests.around_a_tag import SITE

NEAR = Belief(0, np.zeros(3), 1e-4 * np.eye(3))
UNSAID = (np.nan, np.nan, np.nan)


def columns_of(site, *, reads="1"):
    """A vehicle that stands: frames with the tag twice right, once far off and once not, and scans that see a post."""
    there = np.array([(1.0, 0.0, np.pi, *UNSAID)])
    records = [Odometry(0, np.zeros(3)), Odometry(10, np.zeros(3))]
    for stamp, rows in ((1, there), (2, there), (3, there + np.array((0.5, 0.0, 0.0, 0.0, 0.0, 0.0))), (4, there[:0])):
        records.append(TagSightings(stamp, rows, (reads,) * len(rows)))
    records += [Detections(5, np.array([(2.0, 0.0)])), Detections(6, np.empty((0, 2)))]
    return run(RecordLog.collect(records), LocalizerSetup.of(site), NEAR)


def test_sightings_are_counted_by_what_became_of_them():
    site = dataclasses.replace(SITE, reflectors=ReflectorMap((Reflector(id="P", x=2.0, y=0.0),)))
    columns = columns_of(site)
    found = tag_figures(columns)
    counts = {name: found[f"tag_{name}"] for name in ("frames", "accepted", "rejected", "unknown")}
    assert counts == {"frames": 4, "accepted": 2, "rejected": 1, "unknown": 0}
    assert found["tag_unseen_fraction"] == 0.25
    assert found["tag_nis_per_row_mean"] == pytest.approx(columns.tags[:2, NIS].sum() / 6.0)
    assert found["tag_nis_before_gate_per_row_mean"] == pytest.approx(columns.tags[:, NIS].sum() / 9.0)
    assert tag_findings(columns) == ()
    # Of two scans one saw the post; frames are no scans.
    assert consistency(columns).unseen_fraction == 0.5


def test_that_no_sighting_counts_is_said():
    (said,) = tag_findings(columns_of(dataclasses.replace(SITE, tags=())))
    assert said.found == "the recording holds 3 sightings of tags, and the site has none"
    (said,) = tag_findings(columns_of(SITE, reads="tag_1"))
    assert said.found == "none of 3 sightings is of a tag of the site"
    assert "'tag_1'" in said.probably
