"""The kernels of a unit as plain Python: a readable, slow reference with the same bits as the compiled ones.

`load("engine", np.float32)` runs the same files, with C features replaced by NumPy: a lane vector is an array of eight, the
address of an array is the flat array, and a struct is an object with attributes. Needs Cython, for its `cython` module.
"""

from __future__ import annotations

import ast
import math
import time
from collections.abc import Callable
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any, Final

import numpy as np

from pyverlet.core import joining, kernels

_LANES: Final = 8


def _integer(dtype: type[np.integer[Any]]) -> Callable[..., Any]:
    """A C integer type, which wraps around and truncates."""
    bits = 8 * np.dtype(dtype).itemsize

    def cast(value: Any = 0) -> Any:
        whole = int(value) & ((1 << bits) - 1)
        return dtype(whole - (1 << bits) if np.issubdtype(dtype, np.signedinteger) and whole >> (bits - 1) else whole)

    return cast


def _address(dtype: Any, *, writable: bool) -> Callable[[Any], Any]:
    """A function that returns the address of an array: here the flat array, which must be of the type and contiguous."""

    def address(array: Any) -> Any:
        wrong = array.dtype != dtype and not (dtype == np.uint8 and array.dtype == np.bool_)
        if wrong:
            raise TypeError(f"the array has items {array.dtype}; allowed is {np.dtype(dtype).name}")
        if not array.flags.c_contiguous or (writable and not array.flags.writeable):
            raise ValueError("the array is not C-contiguous and writable")
        return array.reshape(-1)

    return address


def _lanes(real: Any) -> dict[str, Any]:
    """`lanes.h` in NumPy."""

    def at(index: Any, k: int, width: int = 1) -> Any:
        return width * index[k : k + _LANES].astype(np.int64)

    def store(array: Any, k: int, a: Any) -> None:
        array[k : k + _LANES] = a

    def scatter(array: Any, index: Any, k: int, a: Any) -> None:
        array[at(index, k)] = a

    def take(array: Any, index: Any, k: int) -> Any:
        i = at(index, k, 2)
        return SimpleNamespace(x=array[i], y=array[i + 1])

    def take4(array: Any, index: Any, k: int) -> Any:
        i = at(index, k, 4)
        return SimpleNamespace(x=array[i], y=array[i + 1], z=array[i + 2], w=array[i + 3])

    def put(array: Any, index: Any, k: int, *values: Any) -> None:
        i = at(index, k, len(values))
        for offset, value in enumerate(values):
            array[i + offset] = value

    def spread(a: Any) -> Any:
        return np.full(_LANES, a, real)

    return {
        "LANES": _LANES,
        "real": real,
        "lanes": real,
        "mask": np.bool_,
        "lanes2": SimpleNamespace,
        "lanes4": SimpleNamespace,
        "spread": spread,
        "load": lambda array, k: array[k : k + _LANES].copy(),
        "store": store,
        "above": np.greater,
        "equal": np.equal,
        "both": np.logical_and,
        "either": np.logical_or,
        "outside": np.logical_not,
        "choose": lambda mask, a, b: np.where(mask, a, b),
        "any_lane": np.any,
        "bits_of": lambda mask: sum(1 << lane for lane in range(_LANES) if mask[lane]),
        "lowest_bit": lambda bits: (int(bits) & -int(bits)).bit_length() - 1,
        "any_above": lambda a, b: bool(np.any(a > b)),
        "larger": lambda a, b: np.where(a > b, a, b),
        "smaller": lambda a, b: np.where(a < b, a, b),
        "largest_lane": np.max,
        "where_zero": lambda test, a, b: np.where(test == 0, a, b),
        "magnitude": lambda a: np.where(a < 0, -a, a),
        "square_root": np.sqrt,
        "sum_of_pairs": lambda a: a + a.reshape(-1, 2)[:, ::-1].reshape(-1),
        "gather": lambda array, index, k: array[at(index, k)],
        "scatter": scatter,
        "take": take,
        "put": put,
        "take4": take4,
        "load2": lambda array, k: take(array[2 * k :], np.arange(_LANES), 0),
        "load4": lambda array, k: take4(array[4 * k :], np.arange(_LANES), 0),
        "store2": lambda array, k, *values: put(array[2 * k :], np.arange(_LANES), 0, *values),
        "store4": lambda array, k, *values: put(array[4 * k :], np.arange(_LANES), 0, *values),
        "put4": put,
    }


def _arrays(real: Any) -> dict[str, Any]:
    """`arrays.h` in NumPy."""
    types = {
        "reals": real,
        "singles": np.float32,
        "doubles": np.float64,
        "integers": np.int64,
        "small_integers": np.int32,
        "indices": np.uint32,
        "words": np.uint64,
        "shorts": np.uint16,
        "octets": np.uint8,
    }
    made = {name: _address(dtype, writable=True) for name, dtype in types.items()}
    made |= {f"const_{name}": _address(dtype, writable=False) for name, dtype in types.items()}
    return (
        {"column_function": None}
        | made
        | {f"{name}_in": lambda arrays, key, address=each: address(arrays[key]) for name, each in made.items()}
    )


def _team() -> dict[str, Any]:
    """`team.h` with one thread."""

    def reserve(team: Any, places: int) -> int:
        team.reserved += places
        return int(team.reserved - places)

    return {
        "thread_team": SimpleNamespace,
        "team_function": None,
        "team_new": lambda threads: SimpleNamespace(threads=1, parts=1, reserved=0),
        "team_run": lambda team, function, argument, parts: function(argument, 0),
        "team_stage": lambda team, function, argument, items: [function(argument, item) for item in range(items)],
        "team_take_number": lambda team: 0,
        "team_give_number": lambda team, number: None,
        "team_reserve": reserve,
        "team_reserved": lambda team: team.reserved,
        "team_reserve_from": lambda team, place: setattr(team, "reserved", place),
        "team_enter": lambda team, span: None,
        "team_clock": time.perf_counter,
        "team_spent": lambda team, span, spent: 0,
        "team_free": lambda team: None,
    }


def _math() -> dict[str, Any]:
    """`libc.math` for kernels: functions of float64, and those of float32 whose name ends in f."""
    made: dict[str, Any] = {"fabs": abs, "INFINITY": np.inf, "NAN": np.nan, "isfinite": math.isfinite, "isnan": math.isnan}
    for name, function in (
        ("sqrt", np.sqrt),
        ("rint", np.rint),
        ("floor", np.floor),
        ("ceil", np.ceil),
        ("log2", np.log2),
    ):  # correctly rounded everywhere
        made |= {name: partial(_call, function, np.float64), f"{name}f": partial(_call, function, np.float32)}
    for name in ("hypot", "sin", "cos", "atan2", "log", "exp", "pow", "fmod"):
        made[name] = partial(_call, getattr(math, name), np.float64)
    made["ldexp"] = lambda x, power: np.float64(math.ldexp(x, int(power)))
    return made


def _call(function: Callable[..., Any], kind: Any, *values: Any) -> Any:
    return kind(function(*map(kind, values)))


_INTEGERS: Final = {
    f"{sign}int{bits}_t": _integer(np.dtype(f"{sign}int{bits}").type) for sign in ("", "u") for bits in (8, 16, 32, 64)
}


def _convert(kind: Any, value: Any) -> Any:
    """Convert a value to a C variable's type; pointers and structs are unchanged."""
    is_number = kind in (int, bool) or kind in _INTEGERS.values() or (isinstance(kind, type) and issubclass(kind, np.generic))
    return kind(value) if is_number else value


class _Typed(ast.NodeTransformer):
    """Makes declared variables keep their C type, and float literals C doubles."""

    def __init__(self) -> None:
        self.kinds: dict[str, ast.expr] = {}

    def _as(self, kind: ast.expr, value: ast.expr) -> ast.expr:
        return ast.Call(ast.Name("_convert", ast.Load()), [kind, value], [])

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.kinds = {}
        for each in ast.walk(node):
            if isinstance(each, ast.AnnAssign) and isinstance(each.target, ast.Name):
                self.kinds[each.target.id] = each.annotation
        taken: list[ast.stmt] = []
        for argument in [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]:
            if isinstance(argument.annotation, ast.Name | ast.Attribute):
                self.kinds[argument.arg] = argument.annotation
                value = self._as(argument.annotation, ast.Name(argument.arg, ast.Load()))
                taken.append(ast.Assign([ast.Name(argument.arg, ast.Store())], value))
        self.kinds = {name: kind for name, kind in self.kinds.items() if isinstance(kind, ast.Name | ast.Attribute)}
        node.body = taken + [self.visit(statement) for statement in node.body]
        return node

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.stmt:
        if node.value is None:  # in C a variable
            kind, count = (
                (node.annotation.value, node.annotation.slice)
                if isinstance(node.annotation, ast.Subscript)
                else (node.annotation, ast.Constant(0))
            )
            return ast.Assign([node.target], ast.Call(ast.Name("_variable", ast.Load()), [kind, count], []))
        return self.visit_Assign(ast.Assign([node.target], node.value))

    def visit_Assign(self, node: ast.Assign) -> ast.Assign:
        self.generic_visit(node)
        target = node.targets[0]
        if len(node.targets) == 1 and isinstance(target, ast.Name) and target.id in self.kinds:
            node.value = self._as(self.kinds[target.id], node.value)
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.stmt:
        if not isinstance(node.target, ast.Name) or node.target.id not in self.kinds:
            self.generic_visit(node)
            return node
        return self.visit_Assign(ast.Assign([node.target], ast.BinOp(ast.Name(node.target.id, ast.Load()), node.op, node.value)))

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        return self._as(ast.Name("_double", ast.Load()), node) if isinstance(node.value, float) else node


def _variable(kind: Any, count: int) -> Any:
    """A local variable, or an array: structs with their fields, all else 0."""
    one = kind if getattr(kind, "__qualname__", "").startswith("_struct.") else partial(_convert, kind, 0)
    return [one() for _ in range(count)] if count else one()


def _struct(**kinds: Any) -> type:
    """A struct: attributes that keep their type, initially 0."""

    class Struct:
        def __init__(self) -> None:
            for name in kinds:
                setattr(self, name, 0)

        def __setattr__(self, name: str, value: Any) -> None:
            object.__setattr__(self, name, _convert(kinds[name], value))

        def __getitem__(self, index: int) -> Struct:
            return self

    return Struct


def _cython() -> ModuleType:
    """Cython's own module for uncompiled code, with the types, structs and addresses above."""
    from Cython import Shadow  # only the reference needs it

    made = ModuleType("cython")
    vars(made).update(vars(Shadow))

    def declare(kind: Any = None, value: Any = None, **_: Any) -> Any:
        return None if value is None else _convert(kind, value)

    def cclass(made: type) -> type:
        """Give each instance the structs that its class declares, as C does."""
        structs = {name: type(value) for name, value in vars(made).items() if type(value).__qualname__.startswith("_struct.")}

        def new(cls: type, *_: Any, **__: Any) -> Any:
            self: Any = object.__new__(cls)
            for name, kind in structs.items():
                setattr(self, name, kind())
            return self

        made.__new__ = new  # type: ignore[assignment,method-assign]
        return made

    types = {"double": np.float64, "float": np.float32, "Py_ssize_t": int, "int": int, "bint": bool}
    vars(made).update(
        types,
        sizeof=lambda kind: np.dtype(kind).itemsize,
        struct=_struct,
        declare=declare,
        cclass=cclass,
        cast=_convert,
        address=lambda value: value,
    )
    return made


def load(unit: str, dtype: Any = np.float32) -> ModuleType:
    """The unit as a module of plain Python functions, for arrays of this precision."""
    real = np.dtype(dtype).type
    stand_ins = {
        "lanes": _lanes(real),
        "arrays": _arrays(real),
        "team": _team(),
        "libc.math": _math(),
        "libc.stdint": _INTEGERS,
        "processor": {"x86_64_level": lambda: 0, "compiler_name": lambda: b"none"},
    }
    module = ModuleType(f"{unit}_reference")
    names = vars(module)
    names.update(kernel=kernels.kernel, inlined=kernels.inlined, _convert=_convert, _double=np.float64, _variable=_variable)
    for part in joining.parts(unit):
        kept = ast.parse("from __future__ import annotations").body
        for node in part.tree.body:
            if isinstance(node, ast.Import) and node.names[0].name == "cython":
                names["cython"] = _cython()
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("cython.cimports."):
                stand_in = stand_ins[str(node.module).removeprefix("cython.cimports.")]
                names.update({alias.asname or alias.name: stand_in[alias.name] for alias in node.names})
            else:
                kept.append(_Typed().visit(node))
        tree = ast.fix_missing_locations(ast.Module(kept, []))
        exec(compile(tree, str(part.path), "exec"), names)
    return module
