"""python3 -m shakebed: the command line."""

import os
import sys

from .runs import program

if __name__ == "__main__":
    command = program()
    os.execv(command, [command, *sys.argv[1:]])
