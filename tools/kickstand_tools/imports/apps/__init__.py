"""The formats that are known, one module each: finds() picks its files, read() makes a Recording of them."""
