"""The project as a whole: its name, its files, undo and redo, what it is about."""

from __future__ import annotations

from commission.app.base.feature import SITE, Docked, Feature
from commission.app.project import reducer
from commission.app.project.copy_question import CopyQuestionPanel
from commission.app.project.project_fields import ProjectFields
from commission.app.project.project_folder import ProjectFolder
from commission.app.project.site_panel import SitePanel
from commission.app.project.top_bar import ProjectButtons, TitlePanel

FEATURE = Feature(
    "project",
    reducers=(reducer,),
    services=(ProjectFolder,),
    panels=(
        Docked(lambda at: TitlePanel(at.gui, at.state), None, 0),
        Docked(lambda at: ProjectButtons(at.gui, at.post), None, 30),
        Docked(lambda at: SitePanel(at.gui, at.state.project), SITE, 0),
        Docked(lambda at: ProjectFields(at.gui, at.post, at.state.project), SITE, 10, folder="Project"),
        Docked(lambda at: CopyQuestionPanel(at.gui, at.post, at.browser), SITE, 10, own=True),
    ),
)
