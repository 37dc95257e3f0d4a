"""python -m kickstand_tools.cli"""

from .main import main

main()
