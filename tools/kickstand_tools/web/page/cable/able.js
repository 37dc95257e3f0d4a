// Records before the page is drawn whether this browser can connect to a board. The browser must offer serial ports
// (only over https or from this computer) and must let Python wait for them.
document.documentElement.dataset.bluetooth = "bluetooth" in navigator ? "yes" : "no"; // of the page Live alone
document.documentElement.dataset.serial = "serial" in navigator && "Suspending" in WebAssembly ? "yes" : "no";
