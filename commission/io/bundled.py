"""Where the folders that travel with the program are: sites (`maps`) and the page's meshes and pictures (`web_assets`).

It finds them in an installed package and in a checkout; it does not read what is in them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from commission.errors import FileFormatError

PACKAGE_FOLDER = Path(__file__).resolve().parents[1]


def bundled_folder(name: Literal["maps", "web_assets"], package_folder: Path = PACKAGE_FOLDER) -> Path:
    """Folder that travels with the program.

    Parameters
    ----------
    name : which of the two.
    package_folder : folder of the package `commission`; another one only in tests.

    Returns
    -------
    folder : an existing folder, possibly not writable.

    Raises
    ------
    FileFormatError
        neither the installed package nor a checkout around it has the folder.
    """
    installed = package_folder / "_data" / name
    if installed.is_dir():
        return installed
    checkout = package_folder.parent
    # pyproject.toml tells a checkout from site-packages, where a folder called `maps` would be somebody else's.
    if (checkout / "pyproject.toml").is_file() and (checkout / name).is_dir():
        return checkout / name
    raise FileFormatError(installed, "", "the bundled folder is missing", "a complete installation of commission")
