"""Runs the source of a module with machine code as plain Python. quick.py says when."""

_POINTERS = ("ptr8", "ptr16", "ptr32")
_SKIPPED = ("from micropython import const", "import micropython", "@micropython.viper")
_ENDINGS = ("_plain.py", ".py")  # `kickstand flash` adds the source, as NAME_plain.py, to a compiled module


def run(name):
    """Run a module's source as plain Python. Return its names and their values. Raises ImportError without a source."""
    folder = __file__.replace("\\", "/").rpartition("/")[0] or "."
    names = dict.fromkeys(_POINTERS)
    names["const"] = lambda value: value
    for ending in _ENDINGS:
        try:
            with open("%s/%s%s" % (folder, name, ending)) as file:
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
