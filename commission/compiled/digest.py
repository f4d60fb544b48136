"""What a kernel's machine code depends on, as one digest: its own code and, transitively, all that it reads and calls.

It knows neither numba nor files. Bytecode holds no comments and no line numbers, and the docstring is left out: an edit
of those changes no digest.
"""

from __future__ import annotations

import dis
import enum
import functools
import hashlib
from collections.abc import Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np

_SCALARS = (type(None), type(Ellipsis), bool, int, float, complex, str, bytes, np.generic, np.dtype)

_READS_FIRST_CONSTANT = tuple(bytes((operation, 0)) for operation in dis.hasconst if operation < 256)


def kernel_digest(kernel: Any) -> str:
    """Digest of everything that goes into the machine code of one kernel, but for the types of its arguments.

    That is its bytecode, its compiler options and default arguments, the values of the constants it reads (of its own
    module or of others), the fields of the named tuples and enumerations it names, and the same of each kernel that it
    calls: their code is linked or inlined into its own.

    Parameters
    ----------
    kernel : compiled function (it has `py_func` and `targetoptions`), or a plain one.

    Raises
    ------
    TypeError
        If the kernel reads a global whose state cannot be described, so that a change of it would go unseen.
    """
    states: dict[Any, str] = {}
    pending = [kernel]
    while pending:
        current = pending.pop()
        if current not in states:
            states[current], called = _own_state(current)
            pending.extend(called)
    return hashlib.sha256("\n".join(sorted(states.values())).encode()).hexdigest()


@functools.cache
def _own_state(kernel: Any) -> tuple[str, tuple[Any, ...]]:
    """Return name and digest of one kernel without those it calls, and these. Kernels live as long as the process."""
    function: FunctionType = getattr(kernel, "py_func", kernel)
    reader = _Describer(function)
    cells = tuple(reader.value(cell.cell_contents) for cell in function.__closure__ or ())
    content = (
        reader.code(function.__code__, function.__doc__),
        sorted((name, reader.value(value)) for name, value in getattr(kernel, "targetoptions", {}).items()),
        reader.value(function.__defaults__),
        sorted((name, reader.value(value)) for name, value in (function.__kwdefaults__ or {}).items()),
        cells,
        reader.names_in(function.__globals__),
    )
    return f"{_name(function)} {hashlib.sha256(repr(content).encode()).hexdigest()}", tuple(reader.called)


class _Describer:
    """Describes what one function reads, and collects the kernels among it.

    Descriptions are nested tuples of strings and bytes: equal exactly if what they describe is equal.
    """

    def __init__(self, function: FunctionType) -> None:
        self.called: list[Any] = []
        self._function = _name(function)
        self._package = function.__module__.partition(".")[0]
        self._names = sorted(set(_names_of(function.__code__)))
        self._modules: set[str] = set()

    def code(self, code: CodeType, docstring: str | None = None) -> tuple[Any, ...]:
        """Return what is executed: no file, no line, no docstring."""
        first = 1 if docstring is not None and not _reads_first_constant(code) else 0
        constants = tuple(
            self.code(value) if isinstance(value, CodeType) else self.value(value) for value in code.co_consts[first:]
        )
        counts = (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        variables = (code.co_names, code.co_varnames, code.co_cellvars, code.co_freevars)
        return (code.co_code, code.co_exceptiontable, constants, counts, variables)

    def names_in(self, namespace: dict[str, Any]) -> tuple[Any, ...]:
        """Describe what the function's names stand for in a module.

        Names of attributes are among them, because bytecode tells them from globals differently in each version of
        Python: where a field is called like a kernel of the module, it counts as read. That compiles too much, never
        too little.
        """
        return tuple((name, self.value(namespace[name])) for name in self._names if name in namespace)

    def value(self, value: Any) -> tuple[Any, ...]:
        """Describe a constant, a class, a module or a kernel."""
        match value:
            case np.ndarray():
                layout = (value.dtype.str, value.shape, value.flags.c_contiguous, value.flags.f_contiguous)
                return ("array", layout, value.tobytes())
            case enum.Enum():
                return ("member", _name(type(value)), value.name, self.value(value.value))
            case tuple():
                return ("tuple", _name(type(value)), tuple(self.value(item) for item in value))
            case frozenset():
                return ("set", *sorted(repr(self.value(item)) for item in value))
            case _ if isinstance(value, _SCALARS):
                return (type(value).__name__, repr(value))
            case _:
                return self._named(value)

    def _named(self, value: Any) -> tuple[Any, ...]:
        """Describe what has a name of its own."""
        if isinstance(value, ModuleType):
            return self._module(value)
        if isinstance(value, type):
            return self._class(value)
        if hasattr(value, "py_func") or (isinstance(value, FunctionType) and self._is_ours(value)):
            self.called.append(value)
            return ("kernel", _name(getattr(value, "py_func", value)))
        if callable(value) and hasattr(value, "__name__"):
            return ("function", _name(value))
        raise TypeError(
            f"kernel {self._function} reads a global of type {_name(type(value))}; expected a number, text, array, "
            "tuple, enumeration, class, module or kernel: of others it is not known when they change"
        )

    def _module(self, module: ModuleType) -> tuple[Any, ...]:
        """Describe what is read through a module, such as `math.pi` or a kernel of another module of ours."""
        if module.__name__ in self._modules:
            return ("module", module.__name__)
        self._modules.add(module.__name__)
        return ("module", module.__name__, self.names_in(vars(module)))

    def _class(self, kind: Any) -> tuple[Any, ...]:
        """Describe a class: of a named tuple the order of fields, which is compiled into each access by name."""
        if issubclass(kind, enum.Enum):
            return ("enumeration", _name(kind), tuple(self.value(member) for member in kind))
        if issubclass(kind, tuple) and hasattr(kind, "_fields"):
            defaults: dict[str, Any] = getattr(kind, "_field_defaults", {})
            return ("named tuple", *named_fields(kind), tuple((n, self.value(v)) for n, v in defaults.items()))
        return ("class", _name(kind))

    def _is_ours(self, function: FunctionType) -> bool:
        return function.__module__.partition(".")[0] == self._package


def named_fields(kind: Any) -> tuple[str, ...]:
    """Name and fields of a class of named tuples, in their order."""
    return (_name(kind), *kind._fields)


def _name(value: Any) -> str:
    """Return the full name of a function or class."""
    return f"{getattr(value, '__module__', None)}.{getattr(value, '__qualname__', value.__name__)}"


def _reads_first_constant(code: CodeType) -> bool:
    """Tell whether the first constant, where Python keeps the docstring, is used as a value, too (or might be)."""
    return any(reading in code.co_code for reading in _READS_FIRST_CONSTANT)


def _names_of(code: CodeType) -> Iterator[str]:
    """Names of globals and attributes in a function and in those inside it."""
    yield from code.co_names
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield from _names_of(value)
