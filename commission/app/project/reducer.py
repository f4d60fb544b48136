"""What the actions about the project as a whole mean. Pure; importing it registers them with `reduce`."""

from __future__ import annotations

from dataclasses import replace

from commission.app.base.actions import Sender
from commission.app.base.effects import Effect, Tell
from commission.app.base.reducer import Outcome, reduce
from commission.app.base.state import AppState, Edit, edited, refuse_read_only
from commission.app.project import actions
from commission.app.project.effects import KeepProjectIn, ReadProject, TakeProjectOver, WriteProject
from commission.app.project.state import CopyQuestion, FilesState
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
    if folder == state.folder:
        refuse_read_only(state)
    return Outcome(state, (WriteProject(state.project, folder, action.overwrite),))


@reduce.register
def project_saved(action: actions.ProjectSaved, state: AppState, sender: Sender) -> Outcome:
    """From now on the project is kept where it was written."""
    state = state.with_browser(sender.browser, CopyQuestion())
    is_elsewhere = action.folder != state.folder
    saved = replace(state, saved=action.project, folder=action.folder, read_only="", last_edit=None, greeting="")
    keep: tuple[Effect, ...] = (KeepProjectIn(action.project, action.folder),) if is_elsewhere else ()
    told = Tell(f"saved in {action.folder}", failed=False, everywhere=True)
    return Outcome(saved.with_part(FilesState(saved_at=action.time_of_day)), (*keep, told))


@reduce.register
def changed_on_disk(action: actions.ChangedOnDisk, state: AppState, _sender: Sender) -> Outcome:
    """Tell that somebody else works on the files."""
    files = state.part(FilesState)
    if action.files == files.foreign:
        return Outcome(state)
    text = f"changed on disk by somebody else: {', '.join(action.files)}; Read again takes it, Overwrite keeps yours"
    if files.kept_in is not None:
        text = f"the folder {state.folder} is gone; Overwrite writes the project there anew"
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
    """Take what the files hold: one undo step, unless somebody else edits them and this page only follows."""
    listed = state.with_faults(*(note for note in action.notes if note not in state.faults))
    read = replace(listed, saved=action.project).with_part(replace(state.part(FilesState), foreign=()))
    if state.read_only:
        return Outcome(replace(read, project=action.project, undo=(), redo=(), last_edit=None))
    told = (Tell("; ".join(action.notes[:3]), failed=False),) if action.notes else ()
    return Outcome(edited(read, action.project, Edit("read again from disk", sender)), told)


@reduce.register
def restored(action: actions.EditsRestored, state: AppState, sender: Sender) -> Outcome:
    """Take what the journal held: one undo step, told to each browser that comes."""
    files = replace(state.part(FilesState), foreign=action.foreign)
    greeted = replace(state, greeting=action.text).with_part(files)
    return Outcome(
        edited(greeted, action.project, Edit("restore unsaved edits", sender)), (Tell(action.text, failed=False),)
    )


@reduce.register
def ask_to_replace(action: actions.AskToReplace, state: AppState, sender: Sender) -> Outcome:
    """Ask before a copy replaces something."""
    text = f"{action.folder} holds {action.holds}; it stays unless you answer Replace it"
    return Outcome(state.with_browser(sender.browser, CopyQuestion(action)), (Tell(text, failed=True),))


@reduce.register
def keep_other(_action: actions.KeepOther, state: AppState, sender: Sender) -> Outcome:
    """Replace nothing."""
    return Outcome(state.with_browser(sender.browser, CopyQuestion()))


@reduce.register
def take_over(_action: actions.TakeOver, state: AppState, _sender: Sender) -> Outcome:
    """Take the project from whoever edits it elsewhere; nothing happens where that is nobody."""
    return Outcome(state, (TakeProjectOver(),) if state.read_only else ())


@reduce.register
def held_by_other(action: actions.HeldByOther, state: AppState, _sender: Sender) -> Outcome:
    """Show the project, but let nobody edit it."""
    files = replace(state.part(FilesState), holder=action.holder, foreign=(), is_protected=True)
    reason = f"it is edited by {action.holder}; Take over lets you edit it here, and makes it read-only there"
    text = f"opened read-only: {reason}"
    if action.was_ours:
        text = f"taken over by {action.holder}, together with all edits made here; this page is read-only from now on"
    held = replace(state, read_only=reason, greeting=text).with_part(files)
    return Outcome(held, (Tell(text, failed=action.was_ours),))


@reduce.register
def held_by_us(action: actions.HeldByUs, state: AppState, _sender: Sender) -> Outcome:
    """Edit the project from where it was left."""
    files = replace(state.part(FilesState), holder="", foreign=())
    held = replace(
        state,
        project=action.project,
        saved=action.project,
        read_only="",
        greeting="",
        undo=(),
        redo=(),
        last_edit=None,
    )
    return Outcome(held.with_part(files), (Tell("the project is edited here from now on", failed=False),))


@reduce.register
def protected(action: actions.Protected, state: AppState, _sender: Sender) -> Outcome:
    """Show how unsaved edits are kept."""
    files = replace(state.part(FilesState), is_protected=action.is_protected, kept_in=action.kept_in)
    return Outcome(state.with_part(files))
