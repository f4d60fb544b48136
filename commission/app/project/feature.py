"""The project as a whole: its name, its files, undo and redo, what it is about and what it still lacks."""

from __future__ import annotations

from commission.app.base.feature import PLAN, RUN, SITE, TUNE, Docked, Feature, Tab
from commission.app.project import browsing, reducer
from commission.app.project.browse_panel import BrowsePanel
from commission.app.project.browse_service import BrowseService
from commission.app.project.copy_question import CopyQuestionPanel
from commission.app.project.guide_panel import GuidePanel, LackingPanel
from commission.app.project.project_fields import ProjectFields
from commission.app.project.project_folder import ProjectFolder
from commission.app.project.site_panel import SitePanel
from commission.app.project.top_bar import ProjectButtons, TitlePanel


def _lacking(tab: Tab) -> Docked:
    """Return the line on top of a step that says what it lacks."""
    return Docked(make=lambda at: LackingPanel(at.gui, tab.name), tab=tab, rank=-100)


FEATURE = Feature(
    name="project",
    reducers=(reducer, browsing),
    services=(ProjectFolder, BrowseService),
    panels=(
        Docked(make=lambda at: TitlePanel(at.gui, at.state), tab=None, rank=0),
        Docked(make=lambda at: ProjectButtons(at.gui, at.post), tab=None, rank=30),
        Docked(make=lambda at: SitePanel(at.gui, at.state.project), tab=SITE, rank=0),
        Docked(make=lambda at: ProjectFields(at.gui, at.post, at.state.project), tab=SITE, rank=10, folder="Project"),
        Docked(make=lambda at: CopyQuestionPanel(at.gui, at.post, at.browser), tab=SITE, rank=10, own=True),
        Docked(make=lambda at: BrowsePanel(at.gui, at.post, at.browser), tab=None, rank=96, own=True),
        Docked(make=lambda at: GuidePanel(at.gui, at.browser), tab=None, rank=95, own=True),
        *(_lacking(tab) for tab in (SITE, PLAN, RUN, TUNE)),
    ),
)
