"""The one place that knows numba: the decorator of every kernel, the cache of what they compile to, and the warm-up.

It holds no kernel of its own. Kernels compile when first called, never at import; `warm_up` calls them beforehand.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
import threading
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import llvmlite
import numba
from numba.core import event as _events

from commission.compiled.digest import kernel_digest, named_fields
from commission.compiled.kernel_files import KernelFiles, usual_folders
from commission.progress import Progress, silent

_numba: Any = numba
"""Without types: those that numba ships leave out what it builds its own cache from."""

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(kernel: Kernel) -> Kernel:
    """Compile a pure function over scalars and arrays on its first call.

    It runs without the interpreter lock, is cached on disk, and keeps IEEE arithmetic: no `fastmath` (live, replay and
    simulation must agree to the last bit, and NaN marks a missing echo), and a division by zero gives infinity or NaN
    rather than an exception, whose checks cost the filter a quarter of its time.
    """
    return _kernel(kernel)


def compiled_inline(kernel: Kernel) -> Kernel:
    """Like `compiled`, and always laid into the kernel that calls it: for steps of a few dozen operations.

    A call hands over every scalar of a named tuple through memory and counts references of every array. What lets
    Python call each of them is left out, which would take a third of the time in which the filter compiles; called from
    Python they are compiled for that as well, see `_InlineKernel`.
    """
    step: Any = _kernel(kernel, forceinline=True, no_cpython_wrapper=True)
    if step is not kernel:
        step.__class__ = _InlineKernel
    return step


def compiled_parallel(kernel: Kernel) -> Kernel:
    """Like `compiled`, with `prange` over all cores: always a function of its own beside the serial one."""
    return _kernel(kernel, parallel=True)


class _InlineKernel(_numba.core.dispatcher.Dispatcher):
    """A kernel that is laid into others; where Python calls it alone, as tests do, it is compiled for that as well."""

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call it from Python."""
        if "alone" not in vars(self):
            self.alone = _kernel(self.py_func, forceinline=True)
        return self.alone(*args, **kwargs)


def _kernel(kernel: Kernel, **options: bool) -> Kernel:
    # No wrapper for C either: nobody calls a kernel from there.
    dispatcher: Any = _numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)(kernel)
    if dispatcher is not kernel:  # with NUMBA_DISABLE_JIT=1 it stays the Python function, to step through
        dispatcher._cache = KernelCache(dispatcher)
    return dispatcher


parallel_range = numba.prange


class KernelCache:
    """Machine code of one kernel on disk, named by all that it depends on.

    numba's own cache goes by the file of the kernel: any edit of the file compiles all its kernels anew, and an edit
    of a kernel in another file none of those that call it. It also numbers its files, so that two programs at once
    may each write the first and read the other's.
    """

    files = KernelFiles(usual_folders())

    def __init__(self, dispatcher: Any) -> None:
        self._dispatcher = dispatcher
        self._digest = ""

    @property
    def cache_path(self) -> str:
        """Folder that is tried first."""
        return str(self.files.folders[0])

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Machine code for these types of arguments, or None."""
        target_context.refresh()
        content = self.files.read(self._file_name(sig, target_context.codegen()))
        if content is None:
            return None
        # The folder is the user's own, like the sources themselves.
        parts = pickle.loads(content)  # noqa: S301
        return _numba.core.compiler.CompileResult._rebuild(target_context, *parts)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code for these types of arguments."""
        if data.lifted or data.library.has_dynamic_globals:
            name = self._dispatcher.py_func.__qualname__
            warnings.warn(f"kernel {name} compiles at each start: it has lifted loops or large globals", stacklevel=2)
            return
        self.files.write(self._file_name(sig, data.codegen), _numba.core.serialize.dumps(data._reduce()))

    def flush(self) -> None:
        """Do nothing: a name stands for one content."""

    def _file_name(self, sig: Any, codegen: Any) -> str:
        """Name of the file for these types of arguments on this processor.

        The digest waits for the first call: a kernel may call one that stands below it in its module.
        """
        if not self._digest:
            self._digest = kernel_digest(self._dispatcher)
        function = self._dispatcher.py_func
        versions = (sys.implementation.cache_tag, numba.__version__, llvmlite.__version__)
        config = _numba.core.config
        switches = (config.OPT, config.BOUNDSCHECK, config.DEBUGINFO_DEFAULT)
        fields = tuple(named_fields(kind) for argument in getattr(sig, "args", sig) for kind in _named_tuples(argument))
        options = sorted(self._dispatcher.targetoptions.items())
        made_for = repr((self._digest, versions, switches, options, codegen.magic_tuple(), str(sig), fields))
        name = f"{function.__module__}.{function.__qualname__}".replace("<", "").replace(">", "")
        return f"{name[:150]}-{hashlib.sha256(made_for.encode()).hexdigest()[:32]}.kernel"


class _Hearing(threading.local):
    """Who hears, in this thread, of what it compiles; kernels compile within each other."""

    told: Callable[[bool], None] | None = None
    depth = 0


class _Compilations(_events.Listener):
    """Hears of all that numba compiles in this program, and tells of it who listens in the thread that does."""

    def __init__(self) -> None:
        self.hearing = _Hearing()

    def on_start(self, event: Any) -> None:  # noqa: ARG002 - numba's
        """A kernel begins to compile."""
        self.hearing.depth += 1
        if self.hearing.depth == 1 and self.hearing.told is not None:
            self.hearing.told(True)

    def on_end(self, event: Any) -> None:  # noqa: ARG002 - numba's
        """One has been compiled, or cannot be."""
        self.hearing.depth -= 1
        if self.hearing.depth == 0 and self.hearing.told is not None:
            self.hearing.told(False)


_COMPILATIONS = _Compilations()
_events.register("numba:compile", _COMPILATIONS)


@contextmanager
def telling_of_compilations(told: Callable[[bool], None]) -> Generator[None]:
    """Tell when this thread begins to compile kernels, and when it has ended; loading compiled ones is not told.

    Which kernels a study needs depends on its input, and on what is on disk: nobody can say so beforehand.

    Parameters
    ----------
    told : called with True at the beginning, and with False at the end, by the thread that compiles.
    """
    hearing = _COMPILATIONS.hearing
    before, hearing.told = hearing.told, told
    try:
        yield
    finally:
        hearing.told = before


def _named_tuples(kind: Any) -> Iterator[Any]:
    """Classes of the named tuples in the type of an argument: their order of fields is compiled into the kernel."""
    types = _numba.core.types
    if isinstance(kind, types.BaseNamedTuple):
        yield kind.instance_class
    if isinstance(kind, types.BaseTuple):
        for item in kind:
            yield from _named_tuples(item)
    elif isinstance(kind, types.Optional):
        yield from _named_tuples(kind.type)


def warm_up(
    steps: Sequence[tuple[str, Callable[[], None]]],
    progress: Progress = silent,
) -> None:
    """Compile (or load from the cache) all kernels in the given order.

    Parameters
    ----------
    steps : name shown to the user and function that calls a module's kernels once on tiny inputs.
    progress : called with the fraction done [0..1] and "compiling" with the name of the step
        that starts; may raise to cancel.
    """
    for done, (name, step) in enumerate(steps):
        progress(done / len(steps), f"compiling {name}")
        step()
    progress(1.0, "compiled")
