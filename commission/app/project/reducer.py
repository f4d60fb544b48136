"""What the actions about the project as a whole mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited
from commission.app.project import actions
from commission.app.project.effects import ReadProject, WriteProject
from commission.app.project.state import FilesState
from commission.errors import UsageError


@reduce.register
def rename_project(action: actions.RenameProject, state: AppState, sender: Sender) -> Outcome:
    """Call the project something else: one undo step."""
    name = " ".join(action.name.split())
    if not name:
        raise UsageError("the project was given no name; expected some letters")
    if name == state.project.name:
        return Outcome(state)
    return Outcome(edited(state, replace(state.project, name=name), Edit("rename the project", sender)))


@reduce.register
def save(action: actions.Save, state: AppState, _sender: Sender) -> Outcome:
    """Write the project where it came from, or somewhere else."""
    folder = action.folder or state.folder
    if folder is None:
        raise UsageError("this project is bundled with the program and stays as it is; name a folder to save a copy in")
    return Outcome(state, (WriteProject(state.project, folder, action.overwrite),))


@reduce.register
def project_saved(action: actions.ProjectSaved, state: AppState, _sender: Sender) -> Outcome:
    """From now on the project is kept where it was written."""
    saved = replace(state, saved=action.project, folder=action.folder, last_edit=None, greeting="")
    return Outcome(saved.with_part(FilesState(action.time_of_day)), (Tell(f"saved in {action.folder}", failed=False),))


@reduce.register
def changed_on_disk(action: actions.ChangedOnDisk, state: AppState, _sender: Sender) -> Outcome:
    """Tell that somebody else works on the files."""
    files = state.part(FilesState)
    if action.files == files.foreign:
        return Outcome(state)
    text = f"changed on disk by somebody else: {', '.join(action.files)}; read it again, or save to overwrite it"
    told = (Tell(text, failed=True),) if action.files else ()
    return Outcome(state.with_part(replace(files, foreign=action.files)), told)


@reduce.register
def reload_project(_action: actions.Reload, state: AppState, _sender: Sender) -> Outcome:
    """Read the files again."""
    if state.folder is None:
        raise UsageError("this project is bundled with the program; expected one in a folder")
    return Outcome(state, (ReadProject(state.folder),))


@reduce.register
def reloaded(action: actions.Reloaded, state: AppState, sender: Sender) -> Outcome:
    """Take what the files hold: one undo step."""
    read = replace(state, saved=action.project).with_part(replace(state.part(FilesState), foreign=()))
    return Outcome(edited(read, action.project, Edit("read again from disk", sender)))


@reduce.register
def restored(action: actions.Restored, state: AppState, sender: Sender) -> Outcome:
    """Take what the journal held: one undo step, told to each browser that comes."""
    files = replace(state.part(FilesState), foreign=action.foreign)
    greeted = replace(state, greeting=action.text).with_part(files)
    return Outcome(
        edited(greeted, action.project, Edit("restore unsaved edits", sender)), (Tell(action.text, failed=False),)
    )
