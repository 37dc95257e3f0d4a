"""The letters of MicroPython's framebuf, 8x8 pixels each (extmod/font_petme128_8x8.h).

The MIT License (MIT). Copyright (c) 2013, 2014 Damien P. George. Permission is hereby granted, free of charge, to any
person obtaining a copy of this software and associated documentation files (the "Software"), to deal in the Software
without restriction, including without limitation the rights to use, copy, modify, merge, publish, distribute,
sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so,
subject to the following conditions: The above copyright notice and this permission notice shall be included in all
copies or substantial portions of the Software. THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS
OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY,
WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE
OR OTHER DEALINGS IN THE SOFTWARE.
"""

from binascii import a2b_base64

# Characters 32 to 127. Each letter has eight bytes, its columns from the left, with the topmost pixel in bit 0
FONT = a2b_base64(
    b"AAAAAAAAAAAAAABPTwAAAAAHBwAABwcAFH9/FBR/fxQAJC5razoSAABjMxgMZmMAADJ/TU13clAAAAAEBgMBAAAAHD5jQQAAAABBYz4c"
    b"AAAIKj4cHD4qCAAICD4+CAgAAACA4GAAAAAACAgICAgIAAAAAGBgAAAAAEBgMBgMBgIAPn9JRX8+AABARH9/QEAAAGJzUUlPRgAAImNJ"
    b"SX82AAAYGBQWf38QACdnRUV9OQAAPn9JSXsyAAADA3l9BwMAADZ/SUl/NgAAJm9JSX8+AAAAACQkAAAAAACA5GQAAAAACBw2Y0FBAAAU"
    b"FBQUFBQAAEFBYzYcCAAAAgNRWQ8GAAA+f0FNTy4AAHx+Cwt+fAAAf39JSX82AAA+f0FBYyIAAH9/QWM+HAAAf39JSUFBAAB/fwkJAQEA"
    b"AD5/QUl7OgAAf38ICH9/AAAAQX9/QQAAACBgQX8/AQAAf38cNmNBAAB/f0BAQEAAAH9/BgwGf38Af38OHH9/AAA+f0FBfz4AAH9/CQkP"
    b"BgAAHj8hYX9eAAB/fxk5b0YAACZvSUl7MgAAAQF/fwEBAAA/f0BAfz8AAB8/YGA/HwAAf38wGDB/fwBjdxwcd2MAAAcPeHgPBwAAYXFZ"
    b"TUdDAAAAf39BQQAAAAIGDBgwYEAAAEFBf38AAAAIDAYGDAgAwMDAwMDAwMAAAAEDBgQAAAAgdFRUfHgAAH9/RER8OAAAOHxERGwoAAA4"
    b"fEREf38AADh8VFRcWAAACH5/CQMCAACYvKSk/HwAAH9/BAR8eAAAAAB9fQAAAABAwICA/X0AAH9/MDhsRAAAAEF/f0AAAAB8fBgwGHx8"
    b"AHx8BAR8eAAAOHxERHw4AAD8/CQkPBgAABg8JCT8/AAAfHwEBAwIAABIXFRUdCAABAQ/f0RkIAAAPHxAQHw8AAAcPGBgPBwAABx8MBgw"
    b"fBwARGw4OGxEAACcvKCg/HwAAERkdFxMRAAACAg+d0FBAAAAAP//AAAAAEFBdz4ICAAAAgMBAwIDAapVqlWqVapV"
)
