"""The one place that knows numba: the decorator of every kernel, its cache folder, and the warm-up.

It holds no kernel of its own. Kernels compile when first called, never at import; `warm_up` calls them beforehand.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from commission.progress import Progress, silent


def sources_digest(package: Path) -> str:
    """Digest of every module that holds kernels.

    numba compiles a kernel anew when its own file changes, but not when a kernel that it calls has changed in another
    file: it would go on with the old one, after an edit or an update. So each state of the sources has its own folder.
    """
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        content = path.read_bytes()
        if b"commission.compiled" in content:
            digest.update(path.relative_to(package).as_posix().encode() + b"\0" + content)
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of compiled kernels: in that of `NUMBA_CACHE_DIR`, else in the user's cache, else in a temporary one."""
    state = sources_digest(Path(__file__).resolve().parent)
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        # A child process inherits what was set below.
        return Path(chosen) if Path(chosen).name == state else Path(chosen) / state
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or str(Path.home() / ".cache")
    folder = Path(base) / "commission" / "kernels" / state
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        # A service user without a home still runs; it compiles anew after each reboot.
        folder = Path(tempfile.gettempdir()) / f"commission-kernels-{os.getuid()}" / state
        folder.mkdir(parents=True, exist_ok=True)
    return folder


# numba reads the variable when it is imported, so it is set before that and nowhere else.
os.environ["NUMBA_CACHE_DIR"] = str(cache_folder())

import numba  # noqa: E402

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def compiled(kernel: Kernel) -> Kernel:
    """Compile a pure function over scalars and arrays on its first call.

    It runs without the interpreter lock, is cached on disk, and keeps IEEE arithmetic: no `fastmath` (live, replay and
    simulation must agree to the last bit, and NaN marks a missing echo), and a division by zero gives infinity or NaN
    rather than an exception, whose checks cost the filter a quarter of its time.
    """
    return numba.njit(nogil=True, cache=True, error_model="numpy")(kernel)  # type: ignore[no-any-return]


def compiled_inline(kernel: Kernel) -> Kernel:
    """Like `compiled`, and always laid into the kernel that calls it: for steps of a few dozen operations.

    A call hands over every scalar of a named tuple through memory and counts references of every array.
    """
    return numba.njit(nogil=True, cache=True, error_model="numpy", forceinline=True)(kernel)  # type: ignore[no-any-return]


def compiled_parallel(kernel: Kernel) -> Kernel:
    """Like `compiled`, with `prange` over all cores: always a function of its own beside the serial one."""
    return numba.njit(nogil=True, cache=True, error_model="numpy", parallel=True)(kernel)  # type: ignore[no-any-return]


parallel_range = numba.prange


def warm_up(
    steps: Sequence[tuple[str, Callable[[], None]]],
    progress: Progress = silent,
) -> None:
    """Compile (or load from the cache) all kernels in the given order.

    Parameters
    ----------
    steps : name shown to the user and function that calls a module's kernels once on tiny inputs.
    progress : called with the fraction done [0..1] and the name of the step that starts; may raise to cancel.
    """
    for done, (name, step) in enumerate(steps):
        progress(done / len(steps), name)
        step()
    progress(1.0, "compiled")
