import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Some containers set it; then each worker and each program that a test starts compiles all modules again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest


@pytest.fixture
def in_new_folder(tmp_path, monkeypatch):
    """The present folder is an empty one."""
    monkeypatch.chdir(tmp_path)
