# SPDX-License-Identifier: MIT
"""The only place that imports open3d."""

from __future__ import annotations

import ctypes
import importlib
from types import ModuleType

from hybridreg.runtime.optional_packages import cure


def load_open3d() -> ModuleType:
    """Import open3d, even on a Linux machine without the system's libusb.

    Raises
    ------
    ImportError
        One sentence that names what is missing and how to get it.
    """
    try:
        return importlib.import_module("open3d")
    except ModuleNotFoundError as error:
        raise ImportError(f"this needs {cure('open3d')} ({error})") from error
    except (ImportError, OSError) as error:
        if "libusb" not in str(error):
            raise ImportError(f"open3d is installed, but this machine cannot load it: {error}") from error
    return _load_with_bundled_libusb()


def _load_with_bundled_libusb() -> ModuleType:
    # The open3d wheel links against libusb without including it; the libusb-package wheel includes it. Loading that
    # copy globally first lets the dynamic linker find the symbols by the library's name.
    try:
        libusb = importlib.import_module("libusb_package")
        ctypes.CDLL(str(libusb.get_library_path()), mode=ctypes.RTLD_GLOBAL)
        return importlib.import_module("open3d")
    except (ImportError, OSError) as error:
        raise ImportError(
            "open3d needs the system library libusb-1.0: run `pip install libusb-package` "
            f"or install your system's libusb package ({error})"
        ) from error
