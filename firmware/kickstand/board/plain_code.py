"""Runs the source of a module with machine code as plain Python, on a board that cannot run the machine code."""

_POINTERS = ("ptr8", "ptr16", "ptr32")
_SKIPPED = ("from micropython import const", "import micropython", "@micropython.viper")
_ENDINGS = ("_plain.py", ".py")  # `kickstand flash` adds the source, as NAME_plain.py, to a compiled module


def run(name):
    """Run the source of a module of the firmware. Return its names and their values. Raises ImportError without a
    source."""
    package = "/".join(__file__.replace("\\", "/").split("/")[:-2])
    names = dict.fromkeys(_POINTERS)
    names["const"] = lambda value: value
    for ending in _ENDINGS:
        try:
            with open("%s/%s%s" % (package, name, ending)) as file:
                text = file.read()
            break
        except OSError:
            pass
    else:
        raise ImportError("no module named " + name)
    for words in _SKIPPED:
        text = text.replace(words, "")
    exec(text, names)
    return names
