"""The simulated framebuf draws as MicroPython's own, which it replaces on CPython. Also runs on MicroPython."""

import sys

from kickstand_sim.simulated_board.fakes import framebuf as fake


def picture(module):
    """Draw with every method of a FrameBuffer, also beyond the edges. Return the pixels."""
    pixels, stamp = bytearray(1024), bytearray(24 * 40 // 8)
    canvas = module.FrameBuffer(pixels, 128, 64, module.MONO_VLSB)
    stamped = module.FrameBuffer(stamp, 24, 40, module.MONO_HLSB)
    stamped.rect(1, 2, 20, 30, 1)
    stamped.line(23, 0, 0, 39, 1)
    canvas.text("Lean 23 \x7e\x7f~g", 3, 5, 1)
    canvas.fill_rect(50, 40, 200, 10, 1)
    canvas.rect(-3, 50, 20, 30, 1)
    canvas.blit(stamped, 30, 20, 0)
    canvas.blit(stamped, 110, 50)
    canvas.vline(127, -5, 100, 1)
    canvas.hline(100, 30, 5, 1)
    canvas.text("dark", 60, 41, 0)
    for end in ((0, 63), (127, 63), (127, 20), (64, 0), (0, 33), (90, 32)):
        canvas.line(64, 32, *end, 1)
    canvas.pixel(5, 45, 1)
    assert canvas.pixel(5, 45) == 1 and canvas.pixel(5, 46) == 0 and canvas.pixel(500, 1) is None
    return bytes(pixels)


def test_it_draws_as_micropythons_own():
    """The checksum is that of MicroPython's picture, so it also judges a run on CPython."""
    if sys.implementation.name == "micropython":
        import framebuf  # pyright: ignore[reportMissingImports]

        assert picture(framebuf) == picture(fake)
    assert sum([(k + 1) * value for k, value in enumerate(picture(fake))]) == 20587432
