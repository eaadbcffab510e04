"""``python -m pipeline`` is ``treepipe``."""

from pipeline.cli.main import main

if __name__ == "__main__":
    main(prog_name="treepipe")
