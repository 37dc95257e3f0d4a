"""Loads the functions that run as machine code, from modules whose names end in _viper.

Machine code cannot run on CPython, on a port without viper, on an ESP32 without enough free memory, or on a kind of
chip that it was not compiled for. Some releases of MicroPython had bugs in the compiler for some boards. In these cases
the same source runs as plain Python.
"""

from array import array
from binascii import crc32

from .errors import Notice, report

NO_MACHINE_CODE = (ImportError, NameError, SyntaxError, MemoryError, ValueError)  # exceptions of an import

plain = []  # names of the functions that run as plain Python


def passes(name, function, arguments, mark):
    """Return True if a function gives the right results. Otherwise report it on the console.

    Args:
        name: the function's name, because machine code has none.
        function: the function.
        arguments: the arguments for one call.
        mark: the CRC32 of the function's result and of the arguments after the call.
    """
    checksum = crc32(array("i", (function(*arguments) or 0,)))
    for argument in arguments:
        checksum = checksum if isinstance(argument, int) else crc32(argument, checksum)
    if checksum != mark:
        report(Notice("wrong-code", name))
    return checksum == mark


def load(name, *trials):
    """Load functions of a module. Return them as a list.

    Args:
        name: the module's path in this package, without its ending.
        trials: the name of each function, and a function that returns the arguments and the mark for passes().
    """
    functions, source = [], {}
    try:
        module = __import__("kickstand." + name.replace("/", "."), None, None, ("",))
    except NO_MACHINE_CODE:
        module = None
    for function_name, trial in trials:
        function = module and getattr(module, function_name)
        if not (function and passes(function_name, function, *trial())):
            if not source:
                from .board.plain_code import run  # imported only on boards that need it

                source = run(name)
            function = source[function_name]
            plain.append(function_name)
        functions.append(function)
    return functions
