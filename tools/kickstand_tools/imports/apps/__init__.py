"""The formats that are known, one module each: finds() tells its files apart, read() makes a Recording of them."""
