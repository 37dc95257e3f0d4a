// Runs before the page is drawn, and records whether this browser can connect to a board. The browser must offer serial
// ports. It offers them only over https or from this computer. It must also let Python wait for them.
document.documentElement.dataset.bluetooth = "bluetooth" in navigator ? "yes" : "no"; // used only by the page Live
document.documentElement.dataset.serial = "serial" in navigator && "Suspending" in WebAssembly ? "yes" : "no";
