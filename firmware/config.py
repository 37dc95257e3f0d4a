"""Your settings. To change a line, remove the '#' and the space after it. An unchanged line shows the default."""

# On which side is the kickstand?
# SIDE = "left"             # or "right"

# Sensor
# SAMPLE_HZ = 200           # readings per second: 50, 100, 125 or 200
# ACCEL_RANGE_G = 16        # 2, 4, 8 or 16: vibration beyond the range makes the lean wrong
# GYRO_RANGE_DPS = 500      # 250, 500, 1000 or 2000
# DLPF = 3                  # low-pass of the chip, which must block frequencies over half of SAMPLE_HZ:
#                           # 2 (98 Hz) to 6 (5 Hz) at 200; 3 (44 Hz) to 6 at 100 and 125; 4 (21 Hz) to 6 at 50
# ACCEPT_WHO_AM_I = None    # the number on the display, to try a chip rejected as unknown
# SENSOR_ADDRESS = 0x68     # the address to try first; the other one is 0x69, with AD0 high

# Wiring: GPIO numbers. The defaults are for a Pico and Pico 2, and in brackets for a classic ESP32. On every other
# board set the five pins of sensor, display and button here, because the default pins may be missing or in use.
# SENSOR_I2C = 0            # (not used) on a Pico GP4 / GP5 belong to I2C 0, GP6 / GP7 to I2C 1, and so on alternately
# SENSOR_SDA = 4            # (21)
# SENSOR_SCL = 5            # (22)
# SENSOR_BUS_HZ = 400_000   # (250_000 at most)
# LCD_I2C = 1               # (not used)
# LCD_SDA = 6               # (18) sensor and display may have the same two pins; the bus then has the slower speed
# LCD_SCL = 7               # (19)
# LCD_BUS_HZ = None         # None: 100_000 for a character display, 400_000 for an OLED
# LCD_ADDRESSES = (0x27, 0x3F, 0x3C, 0x3D)
# BUTTON_PIN = 15           # (4) button between this pin and ground

# Display
# DISPLAY = "auto"          # a display at 0x3C or 0x3D is an OLED; or "lcd" (HD44780), "ssd1306", "sh1106" (OLEDs
#                           # of 128x64 pixels), "ssd1306-32" (128x32)
# LCD_WIRING = 1            # 1 to 4: the wiring of the backpack, if an LCD stays blank; kickstand status --wirings
# OLED_CONTRAST = 255       # 0 (dim) to 255
# OLED_INVERTED = False     # True: dark on bright

# Speed source and vehicle, to align by driving: a car, bus or trailer needs a source, a motorcycle may have one
# VEHICLE = "motorcycle"    # or "car": anything that does not lean
# SPEED = None              # or "gps": a receiver that sends NMEA; "wheel": a contact that a turning wheel closes
# GPS_UART = 1              # (2)
# GPS_RX = 9                # (16; no default with PSRAM: set both, for example 25 and 26) to the receiver's TX
# GPS_TX = 8                # (17) not connected, but used by the UART
# GPS_BAUD = 9600           # the receiver's baud rate
# WHEEL_PIN = 14            # (27) reed contact or open-collector switch to ground, at most 4000 (300) pulses/s;
#                           never 12 V. Near an ignition: 4.7 kOhm to 3V3 and 10 nF to ground at the pin
# PULSES_PER_METRE = 0.5    # one magnet on a wheel of 2 m circumference: 0.5

# Restart automatically if the program hangs
# WATCHDOG = True

# Record every ride from power-on; if False the menu starts a recording
# RECORD = False

# Live to a phone over Bluetooth LE: Pico W, Pico 2 W, ESP32 (not S2)
# LIVE = False
# LIVE_PIN = None           # six digits, for example 271828, to enter once on each phone; ESP32 only

# SD card for the rides, on SPI. Without a card the rides are stored in the board's flash. Set all five. A Pico also
# needs the driver: mpremote mip install sdcard
# There are no defaults: these values are for a Pico. ESP32: set SD_SPI = 2, a slot of machine.SDCard. A classic ESP32,
# S2 and S3 also have slot 3. Choose free pins, on a classic ESP32 for example SCK 25, MOSI 26, MISO 33, CS 32
# SD_SPI = 0                # or 1
# SD_SCK = 18
# SD_MOSI = 19
# SD_MISO = 16
# SD_CS = 17
