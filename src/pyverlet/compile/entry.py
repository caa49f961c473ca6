"""The way from Python into a compiled kernel, without the detours of Numba's own.

Numba asks for the type of every argument, makes a counted reference of every array and packs them, and the wrapper that does so
for a kernel of 19 arguments takes as long to compile as the kernel. A frame of a small world is little else. `entry` makes a
built-in function instead that compares what it is given, word by word, with what the kernel was compiled for, hands over
addresses, and calls. What it does not know goes to `otherwise`, which takes anything. docs/design/small-worlds.md says what that
saves.

It reads objects as the stable layouts of CPython and NumPy say: the type stands at the end of an object's head, the value of a
number behind it, and so do the data, dimensions and strides of an array. `usable` looks whether that holds.
"""

from __future__ import annotations

import ctypes
import itertools
import sys
import threading
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import llvmlite.binding as llvm
import numba
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.compiler_lock import global_compiler_lock
from numba.extending import intrinsic

_HEAD = object.__basicsize__
_TYPE = _HEAD - 8
# Of NumPy's PyArrayObject, part of its binary interface.
_DATA, _NDIM, _SHAPE, _STRIDES, _DTYPE, _FLAGS = (_HEAD + offset for offset in (0, 8, 16, 24, 40, 48))
_PLAIN = 0x0001 | 0x0100 | 0x0400
"""Flags of an array that stands in one piece, row after row, aligned, and may be written to."""

_HALF = 0xFFFFFFFF
"""Of a word: some fields have 32 bits."""

_NUMBER, _INT, _BOOL, _ARRAY = range(4)
_SCALARS = {float: _NUMBER, np.float32: _NUMBER, np.float64: _NUMBER, np.int64: _NUMBER, int: _INT, bool: _BOOL}

MOST_WORDS = 512
"""Words of 8 bytes the arguments of a kernel may take: an array of two dimensions takes 9."""

RELEASE_FROM = 4096
"""Length of the longest array from which on other Python threads may run meanwhile; for less, letting them costs too much."""

ANY, ALONE, TOGETHER = range(3)
"""When an entry is to be taken: always, on one thread, on several."""


@intrinsic
def _word(typing: Any, address: Any) -> Any:
    """The 8 bytes at an address."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.load(builder.inttoptr(arguments[0], ir.IntType(64).as_pointer()))

    return types.int64(types.int64), code


@intrinsic
def _put(typing: Any, address: Any, value: Any) -> Any:
    """Write the 8 bytes at an address."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        builder.store(arguments[1], builder.inttoptr(arguments[0], ir.IntType(64).as_pointer()))
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), code


@intrinsic
def _buffer(typing: Any) -> Any:
    """Address of MOST_WORDS words on the stack."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.ptrtoint(cgutils.alloca_once(builder, ir.IntType(64), size=MOST_WORDS), ir.IntType(64))

    return types.int64(), code


@intrinsic
def _call(typing: Any, address: Any, words: Any, release: Any) -> Any:
    """Call the function of two words at an address."""

    def code(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        word = ir.IntType(64)
        function = builder.inttoptr(arguments[0], ir.FunctionType(word, [word, word]).as_pointer())
        return builder.call(function, arguments[1:])

    return types.int64(types.int64, types.int64, types.int64), code


_as_int = types.ExternalFunction("PyLong_AsLongLong", types.int64(types.int64))
_append = types.ExternalFunction("PyList_Append", types.int32(types.int64, types.int64))
_this_thread = types.ExternalFunction("PyThread_get_thread_ident", types.int64())
_clear_error = types.ExternalFunction("PyErr_Clear", types.void())
_vectorcall = types.ExternalFunction("PyObject_Vectorcall", types.int64(types.int64, types.int64, types.int64, types.int64))
_threads = types.ExternalFunction("get_num_threads", types.int32())

# Words of an entry's table, and of each argument in it.
_OTHERWISE, _STUB, _WHEN, _COUNT, _LENGTH, _RECORDER, _FIRST = (8 * k for k in range(7))
_WANT, _KIND, _IS, _DIMENSIONS, _BYTES, _STEP = (8 * k for k in range(6))

# Words of the recorder: the thread whose calls are recorded, or 0; how many there are; where the next goes, and the end of the
# room for them; the list that holds what they were given; True and False.
_THREAD, _MADE, _NEXT, _END, _HELD, _TRUE, _FALSE = (8 * k for k in range(7))
_recorder = np.array([0, 0, 0, 0, 0, id(True), id(False)], np.int64)

# Words of a recorded call: what is called, what it answered if that was yes or no, how many words it takes, and whether other
# Python threads may run meanwhile; then those words.
CALLED, ANSWER, TAKEN, RELEASE, CALL = (8 * k for k in range(5))


def _unpack(arguments: int, count: int, want: int, words: int) -> int:
    """Write what the kernel takes to `words`; -1 if an argument is not what it wants, else the length of the longest array."""
    longest = 0
    for k in range(count):
        given, kind = _word(arguments + 8 * k), _word(want + _KIND)
        if _word(given + _TYPE) != _word(want + _WANT):
            return -1
        if kind == _ARRAY:
            dimensions = _word(want + _DIMENSIONS)
            plain = (
                _word(given + _FLAGS) & _PLAIN == _PLAIN and _word(given + _NDIM) & 0xFFFFFFFF == dimensions
            )  # of 32 bits both
            if not plain or _word(given + _DTYPE) != _word(want + _IS):
                return -1
            shape, strides = _word(given + _SHAPE), _word(given + _STRIDES)
            size = 1
            for axis in range(dimensions):
                length = _word(shape + 8 * axis)
                size *= length
                _put(words + 40 + 8 * axis, length)
                _put(words + 40 + 8 * (dimensions + axis), _word(strides + 8 * axis))
            longest = max(longest, _word(shape))
            # In the order of `_parts`, after two that stay empty.
            _put(words + 16, size)
            _put(words + 24, _word(want + _BYTES))
            _put(words + 32, _word(given + _DATA))
            words += 40 + 16 * dimensions
        else:
            value = _word(given + _HEAD)
            if kind == _INT:
                value = _as_int(given)
                if value == -1:  # or too large
                    _clear_error()
                    return -1
            elif kind == _BOOL:
                value = np.int64(given == _word(want + _IS))
            _put(words, value)
            words += 8
        want += _STEP
    return longest


def _enter(table_object: int, arguments: int, count: int) -> int:
    """What Python calls, in C: PyObject *(PyObject *self, PyObject *const *arguments, Py_ssize_t count)."""
    table = _word(table_object + _DATA)
    when = _word(table + _WHEN)
    if count == _word(table + _COUNT) and (when == ANY or (_threads() == 1) == (when == ALONE)):
        words = _buffer()
        longest = unpack(arguments, count, table + _FIRST, words)
        if longest >= 0:
            recorder = _word(table + _RECORDER)
            if _word(recorder) != 0 and _word(recorder) == _this_thread():
                return record(recorder, table, arguments, words, np.int64(longest >= RELEASE_FROM))
            return _call(_word(table + _STUB), words, np.int64(longest >= RELEASE_FROM))
    return _vectorcall(_word(table + _OTHERWISE), arguments, count, 0)


def _record(recorder: int, table: int, arguments: int, words: int, release: int) -> int:
    """Call a kernel, and keep what it was called with, for `_trace`."""
    at, length = _word(recorder + _NEXT), _word(table + _LENGTH)
    _put(recorder + _MADE, _word(recorder + _MADE) + 1)
    _put(recorder + _NEXT, at + CALL + 8 * length)  # beyond the end, if it does not fit
    result = _call(_word(table + _STUB), words, release)
    if _word(recorder + _NEXT) <= _word(recorder + _END):
        for k in range(_word(table + _COUNT)):
            _append(_word(recorder + _HELD), _word(arguments + 8 * k))
        for k in range(length):
            _put(at + CALL + 8 * k, _word(words + 8 * k))
        _put(at + CALLED, _word(table + _STUB))
        _put(at + ANSWER, result if result == _word(recorder + _TRUE) or result == _word(recorder + _FALSE) else 0)
        _put(at + TAKEN, length)
        _put(at + RELEASE, release)
    return result


def record_calls(words: Any, held: list[Any]) -> None:
    """Record the kernels that this thread calls from now on; `held` will hold what they are given."""
    start = words.ctypes.data
    _recorder[:5] = threading.get_ident(), 0, start, start + words.nbytes, id(held)


def recorded_calls() -> tuple[int, int]:
    """Stop. Returns how many calls there were, 0 if some are missing, and the address behind the last."""
    _recorder[_THREAD // 8] = 0
    made, after, end = map(int, _recorder[1:4])
    return made if after <= end else 0, after


def pause() -> bool:
    """Record nothing until `go_on`; False if it is not this thread whose calls are recorded."""
    ours = bool(_recorder[_THREAD // 8] == threading.get_ident())
    if ours:
        _recorder[_THREAD // 8] = 0
    return ours


def go_on() -> None:
    """Record this thread's calls again."""
    _recorder[_THREAD // 8] = threading.get_ident()


def miss() -> None:
    """A kernel is called another way: what this thread records is not all."""
    if _recorder[_THREAD // 8] == threading.get_ident():
        _recorder[_NEXT // 8] = _recorder[_END // 8] + 1


unpack: Any = None
record: Any = None


@cache
def _door(cached: bool) -> Any:
    """`_enter`, compiled for all kernels once, to be declared where its cache is to be."""
    global unpack, record
    numba.get_num_threads()  # makes the function of this name known
    inner = numba.njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
    unpack, record = inner(_unpack), inner(_record)
    return numba.cfunc(types.int64(types.int64, types.int64, types.int64), error_model="numpy", cache=cached)(_enter)


def _parts(kind: Any) -> list[Any]:
    """Of what words Numba's functions take an argument of this kind."""
    if not isinstance(kind, types.Array):
        return [kind]
    parts = [types.MemInfoPointer(kind.dtype), types.pyobject, types.intp, types.intp, types.CPointer(kind.dtype)]
    return parts + [types.intp] * (2 * kind.ndim)


def _stub(compiled: Any) -> int:
    """Address of a function of two words, where arguments are and whether to let other threads run, that calls a kernel."""
    context, made = compiled.target_context, compiled.fndesc
    word = ir.IntType(64)
    module = ir.Module(f"stub of {made.llvm_func_name}")
    function = ir.Function(module, ir.FunctionType(word, [word, word]), name=f"stub.{made.llvm_func_name}")
    builder = ir.IRBuilder(function.append_basic_block())
    api = context.get_python_api(builder)
    words, release = function.args
    words = builder.inttoptr(words, word.as_pointer())
    kinds = [part for kind in made.argtypes for part in _parts(kind)]
    taken = []
    for k, kind in enumerate(kinds):
        what = context.get_argument_type(kind)
        if isinstance(kind, types.MemInfoPointer | types.PyObject):
            taken.append(ir.Constant(what, None))  # nobody counts references, for the arguments outlive the call
        else:
            place = builder.gep(words, [ir.Constant(word, k)])
            taken.append(builder.load(builder.bitcast(place, what.as_pointer())))
    released = builder.icmp_signed("!=", release, ir.Constant(word, 0))
    thread = cgutils.alloca_once_value(builder, api.get_null_object())
    with builder.if_then(released):
        builder.store(api.save_thread(), thread)
    llvm.add_symbol(made.llvm_func_name, compiled.library.get_pointer_to_function(made.llvm_func_name))
    kernel = context.declare_function(module, made)
    status, result = context.call_conv.call_function(builder, kernel, made.restype, kinds, taken)
    with builder.if_then(released):
        api.restore_thread(builder.load(thread))
    with builder.if_then(status.is_ok, likely=True):
        if isinstance(made.restype, types.NoneType):
            result_object = api.make_none()
        else:
            result_object = api.from_native_value(made.restype, result)
        builder.ret(builder.ptrtoint(result_object, word))
    api.err_set_string("PyExc_MemoryError", "a compiled kernel found no memory")  # it knows no other error
    builder.ret(ir.Constant(word, 0))
    return _assembled(module, function.name)


@cache
def _assembler() -> Any:
    machine = llvm.Target.from_default_triple().create_target_machine(opt=0)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


def _assembled(module: Any, name: str) -> int:
    engine = _assembler()
    engine.add_module(llvm.parse_assembly(str(module)))
    engine.finalize_object()
    return int(engine.get_function_address(name))


class _Method(ctypes.Structure):
    """PyMethodDef."""

    _fields_ = (("name", ctypes.c_char_p), ("call", ctypes.c_void_p), ("flags", ctypes.c_int), ("doc", ctypes.c_char_p))


_FASTCALL = 0x0080


def takes(arguments: Sequence[Any]) -> bool:
    """Whether an entry can hand these over: plain arrays and numbers."""
    words = 0
    for a in arguments:
        if type(a) is np.ndarray and a.flags.carray:
            words += 5 + 2 * a.ndim
        elif type(a) in _SCALARS:
            words += 1
        else:
            return False
    return words <= MOST_WORDS


def gives(compiled: Any) -> bool:
    """Whether an entry can hand back what this kernel returns: numbers, or nothing."""
    returned = compiled.signature.return_type
    results = list(returned) if isinstance(returned, types.BaseTuple) else [returned]
    return all(isinstance(kind, types.Number | types.Boolean | types.NoneType) for kind in results)


@global_compiler_lock
def entry(compiled: Any, arguments: Sequence[Any], when: int, otherwise: Callable[..., Any], cached: bool) -> Callable[..., Any]:
    """A built-in function that calls a compiled kernel with arguments of the kinds of these, and `otherwise` with any others."""
    rows = []
    for a in arguments:
        if type(a) is np.ndarray:
            rows.append((id(np.ndarray), _ARRAY, id(a.dtype), a.ndim, a.itemsize))
        else:
            rows.append((id(type(a)), _SCALARS[type(a)], id(True), 0, 0))
    length = sum(5 + 2 * a.ndim if type(a) is np.ndarray else 1 for a in arguments)
    head = (id(otherwise), _stub(compiled), when, len(rows), length, _recorder.ctypes.data)
    table = np.array([*head, *itertools.chain(*rows)], np.int64)
    _KEPT.append((otherwise, compiled, [a.dtype for a in arguments if type(a) is np.ndarray]))
    return built_in(compiled.fndesc.qualname, _door(cached).address, table)


def built_in(name: str, address: int, table: Any) -> Callable[..., Any]:
    """What Python takes for a built-in function: machine code like `_enter`, with a table of its own."""
    method = _Method(name.encode(), address, _FASTCALL, None)
    make = ctypes.pythonapi.PyCFunction_NewEx
    make.argtypes, make.restype = (ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p), ctypes.py_object
    _KEPT.append(method)
    return make(ctypes.addressof(method), table, None)


_KEPT: list[Any] = []
"""What entries need for as long as the process lives, and nobody else holds."""


@cache
def usable() -> bool:
    """Whether objects lie in memory as they are read here."""
    if sys.implementation.name != "cpython" or sys.byteorder != "little" or ctypes.sizeof(ctypes.c_void_p) != 8:
        return False
    array, number = np.zeros((3, 2), np.float32), 1.5

    def look(at: int, kind: Any = ctypes.c_int64) -> Any:
        return kind.from_address(at).value

    return bool(
        look(id(array) + _TYPE) == id(np.ndarray)
        and look(id(number) + _HEAD, ctypes.c_double) == number
        and look(id(np.float32(number)) + _HEAD, ctypes.c_float) == number
        and look(id(array) + _DATA) == array.ctypes.data
        and look(id(array) + _NDIM, ctypes.c_int) == array.ndim
        and [look(look(id(array) + _SHAPE) + 8 * axis) for axis in range(2)] == list(array.shape)
        and [look(look(id(array) + _STRIDES) + 8 * axis) for axis in range(2)] == list(array.strides)
        and look(id(array) + _DTYPE) == id(array.dtype)
        and look(id(array) + _FLAGS, ctypes.c_int) == array.flags.num
    )
