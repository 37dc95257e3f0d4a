// Says before the page is drawn whether this browser can connect to a board: it needs a serial port, which there is only
// over https or from this computer, and has to let Python wait for it.
document.documentElement.dataset.bluetooth = "bluetooth" in navigator ? "yes" : "no"; // of the page Live alone
document.documentElement.dataset.serial = "serial" in navigator && "Suspending" in WebAssembly ? "yes" : "no";
