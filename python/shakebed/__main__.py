"""python3 -m shakebed: the command line."""

import os
import sys

from .runs import program


def main() -> None:
    """Become the program, with the arguments of this one."""
    command = program()
    os.execv(command, [command, *sys.argv[1:]])


if __name__ == "__main__":
    main()
