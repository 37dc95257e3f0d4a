"""Calls of viper functions on the processors of the ESP32s under QEMU: everything that MicroPython would put around
them is laid out in memory, and the helpers that they call are answered from here.

A native function is called with its own object, the numbers of arguments by place and by name, and a pointer to the
arguments. The object holds, in words 1 and up, a pointer to the module's context. The context holds, in words 2 and 3,
pointers to names and constants, and one of the constants is the table of helpers (MicroPython, py/objfun.h, py/bc.h,
py/nativeglue.h).
"""

import struct
from array import array
from pathlib import Path

import native_mpy
from gdb_remote import Target

# In the table of helpers
_TO_NATIVE, _TO_OBJECT, _FLOOR_DIVIDE, _MODULO, _HELPERS = 3, 4, 46, 47, 50

# Where what is in memory, from its beginning on. Vectors of exceptions come first.
_VECTORS, _ENTRY, _IDENTITY, _HELPER, _OBJECTS, _CODE, _STACK, _DATA = (
    0, 0x1000, 0x1100, 0x1200, 0x1800, 0x2000, 0x8000, 0x10000,
)  # fmt: skip


def signed(word: int) -> int:
    """A word of 32 bits as a number."""
    return (word & 0xFFFFFFFF ^ 0x80000000) - 0x80000000


def _answer(helper: int, a: int, b: int) -> int:
    """What MicroPython's helper returns. All arguments are handed over as viper sees them: none needs to be made an
    object, and the conversions give back what they get."""
    if helper == _FLOOR_DIVIDE:
        return signed(a) // signed(b)
    if helper == _MODULO:
        return signed(a) % signed(b)
    raise AssertionError(f"the machine code calls helper {helper}: see MicroPython's py/nativeglue.h")


class Processor:
    """One processor under QEMU, and how its calls look."""

    architecture = ""  # as mpy-cross names it
    command = ()
    memory = 0
    vectors = ()  # where an exception goes on
    entry = b""  # calls the function, and stops behind that
    entry_length = 0
    identity = b""  # a helper that returns its first argument
    pc = 0  # its place in the list of registers

    def __init__(self, target: Target) -> None:
        self._target = target
        self._at_reset = target.registers()
        for vector in self.vectors:
            target.stop_at(self.memory + vector)
        target.stop_at(self.memory + _ENTRY + self.entry_length)
        target.write(self.memory + _ENTRY, self.entry)
        target.write(self.memory + _IDENTITY, self.identity)
        self._helpers = [self.memory + _HELPER + 4 * i for i in range(_HELPERS)]
        for i in _FLOOR_DIVIDE, _MODULO:
            target.stop_at(self._helpers[i])
        self._helpers[_TO_NATIVE] = self._helpers[_TO_OBJECT] = self.memory + _IDENTITY
        self._code: dict[str, int] = {}

    def load(self, source: Path) -> None:
        """Compile a module, and put its functions where call() finds them."""
        module, at = native_mpy.load(source, self.architecture), self.memory + _CODE
        for name, code in module.functions.items():
            self._target.write(at, code)
            self._code[name] = at
            at += (len(code) + 15) // 4 * 4  # the code may be read some bytes beyond its end
        assert at < self.memory + _STACK - 0x1000
        objects = self.memory + _OBJECTS
        context, constants, table = objects + 0x10, objects + 0x20, objects + 0x100
        words = [0] * 0x80
        words[1] = context
        words[4 + 3] = constants
        words[8 + module.table_at] = table
        words[0x40 : 0x40 + _HELPERS] = self._helpers
        assert module.objects <= 0x38
        self._target.write(objects, struct.pack("<128I", *words))

    def call(self, name: str, *arguments: int | array | bytearray | bytes) -> int:
        """Call a function. Arrays are changed as the function changes them; the result is the word it returns."""
        places, words, data = [], [], b""
        first = self.memory + _DATA
        at = first + 4 * len(arguments)
        for argument in arguments:
            if isinstance(argument, int):
                words.append(argument & 0xFFFFFFFF)
                continue
            raw = bytes(argument)
            places.append((argument, len(data), len(raw)))
            words.append(at + len(data))
            data += raw + bytes(-len(raw) % 4)
        self._target.write(first, struct.pack(f"<{len(words)}I", *words) + data)
        function = self.memory + _OBJECTS
        self._target.set_registers(self.at_entry(self._at_reset.copy(), self._code[name], function, len(words), first))
        registers = self._run()
        after = self._target.read(at, len(data))
        for argument, start, length in places:
            if not isinstance(argument, bytes):
                memoryview(argument).cast("B")[:] = after[start : start + length]
        return self.result(registers)

    def _run(self) -> list[int]:
        """Go on until the function has returned; the registers then."""
        while True:
            self._target.go_on()
            registers = self._target.registers()
            at = registers[self.pc] - self.memory
            if at == _ENTRY + self.entry_length:
                return registers
            assert _HELPER <= at < _HELPER + 4 * _HELPERS, f"exception, or a jump to {at + self.memory:#x}"
            self._target.set_registers(self.answered(registers, (at - _HELPER) // 4))

    def at_entry(self, registers: list[int], code: int, function: int, n: int, arguments: int) -> list[int]:
        """The registers before a call."""
        raise NotImplementedError

    def answered(self, registers: list[int], helper: int) -> list[int]:
        """The registers after a helper, from those at its first instruction."""
        raise NotImplementedError

    def result(self, registers: list[int]) -> int:
        """What the function has returned."""
        raise NotImplementedError


class Xtensa(Processor):
    """ESP32, ESP32-S2 and ESP32-S3: Xtensa with register windows (Xtensa ISA reference manual, 4.7.1).

    A caller sees a8, a10, a11 ... where the function that it calls by callx8 sees a0, a2, a3 ..."""

    architecture = "xtensawin"
    command = ("qemu-system-xtensa", "-M", "sim", "-cpu", "dc232b", "-m", "16")
    memory = 0xD0000000
    vectors = (0x0, 0x40, 0x80, 0xC0, 0x100, 0x140, 0x300, 0x340, 0x3C0)  # of the windows; kernel, user, double
    entry = bytes((0xE0, 0x08, 0x00))  # callx8 a8
    entry_length = 3
    identity = bytes((0x36, 0x41, 0x00, 0x1D, 0xF0))  # entry a1, 32; retw.n: its a2 is argument and result
    # Places in the list of registers. a0 to a15 are a window into the first of these, and are named twice.
    _PHYSICAL, _WINDOW_BASE, _WINDOW_START, _PS, _A = 1, 38, 39, 42, 104
    _WOE, _CALLINC = 0x40000, 0x30000  # bits of PS: windows are in use; what the last call has moved by

    def at_entry(self, registers: list[int], code: int, function: int, n: int, arguments: int) -> list[int]:
        registers[self.pc] = self.memory + _ENTRY
        registers[self._WINDOW_BASE], registers[self._WINDOW_START] = 0, 1
        registers[self._PS] = self._WOE
        for i, value in {1: self.memory + _STACK, 8: code, 10: function, 11: n, 12: 0, 13: arguments}.items():
            registers[self._PHYSICAL + i] = registers[self._A + i] = value
        return registers

    def answered(self, registers: list[int], helper: int) -> list[int]:
        a = registers[self._A : self._A + 16]
        value = _answer(helper, a[10], a[11]) & 0xFFFFFFFF
        registers[self._A + 10] = value
        registers[self._PHYSICAL + (4 * registers[self._WINDOW_BASE] + 10) % 32] = value
        registers[self.pc] = a[8] & 0x3FFFFFFF | registers[self.pc] & 0xC0000000
        registers[self._PS] &= ~self._CALLINC
        return registers

    def result(self, registers: list[int]) -> int:
        return registers[self._A + 10]


class RiscV(Processor):
    """ESP32-C3 and -C6: RISC-V with the instructions that the C3 has, I, M and C, and no others."""

    architecture = "rv32imc"
    command = ("qemu-system-riscv32", "-M", "virt", "-cpu", "lowrisc-ibex", "-bios", "none", "-m", "16")
    memory = 0x80000000
    entry = bytes((0x82, 0x92))  # c.jalr t0
    entry_length = 2
    identity = bytes((0x82, 0x80))  # ret: a0 is argument and result
    pc = 32
    _RA, _SP, _T0, _A0 = 1, 2, 5, 10

    def __init__(self, target: Target) -> None:
        super().__init__(target)
        target.stop_at(0)  # exceptions go there after a reset

    def at_entry(self, registers: list[int], code: int, function: int, n: int, arguments: int) -> list[int]:
        registers[self.pc] = self.memory + _ENTRY
        registers[self._SP], registers[self._T0] = self.memory + _STACK, code
        registers[self._A0 : self._A0 + 4] = function, n, 0, arguments
        return registers

    def answered(self, registers: list[int], helper: int) -> list[int]:
        registers[self._A0] = _answer(helper, registers[self._A0], registers[self._A0 + 1]) & 0xFFFFFFFF
        registers[self.pc] = registers[self._RA]
        return registers

    def result(self, registers: list[int]) -> int:
        return registers[self._A0]
