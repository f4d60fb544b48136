"""`python -m commission`: the same as the command `commission`."""

from commission.cli import main

if __name__ == "__main__":
    main()
