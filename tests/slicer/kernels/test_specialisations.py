"""No kernel is compiled twice for one job: neither for a constant nor for another width of whole numbers."""

import importlib
import pkgutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

import gcode
import slicer
from slicer.kernels import inner_kernel, kernel, widest
from vslice.cli import main
from vslice.compiling import compile_kernels, compile_references

EXAMPLES = sorted((Path(__file__).parents[3] / "examples").glob("*.json"))


@inner_kernel
def _half(values, k, places):
    return values[k] + places[0] + places[1]


@kernel
def _calls_it(values, index):
    total = 0.0
    for k in range(len(values)):
        total += _half(values, k, (0, k)) + _half(values, 0, (index[k], 1)) + _half(values, index[k], (1, 2))
    return total


def test_constants_and_widths_share_one_specialisation():
    assert _calls_it(np.arange(3.0), np.array([0, 1, 2], np.int32)) == 24.0
    # Now, or by the run that left both on disk.
    kept = {signature for signature, *_ in _half._cache._cache_file._load_index()}
    assert len(kept | {tuple(one) for one in _half.signatures}) == 1


def specialisations():
    """How often each kernel has been compiled for the same types, now or by the run that left it on disk."""
    made = Counter()
    for name in [
        module.name
        for package in (slicer, gcode)
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")
    ]:
        for found in vars(importlib.import_module(name)).values():
            if isinstance(found, Dispatcher) and found.__module__ == name:
                kept = {signature for signature, *_ in found._cache._cache_file._load_index()}
                for signature in kept | {tuple(one) for one in found.signatures}:
                    made[name, found.__name__, tuple(map(widest, signature))] += 1
    return made


def test_an_installation_compiles_nothing_twice_and_every_kind_of_kernel():
    """Nozzles, cutting, steep tiles, references: what the small sheets of an installation come to."""
    compile_kernels()
    compile_references()
    made = specialisations()
    assert {"cutting", "sequence"} <= {name.split(".")[1] for name, *_ in made}
    for folder in ("bound", "construct", "layered", "local_search", "rural_postman", "states", "tree_search"):
        assert any(name.startswith(f"slicer.sequence.{folder}.") for name, *_ in made), folder
    assert len(made) > 200
    assert [one for one, count in made.items() if count > 1] == []


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_a_slice_of_an_example_compiles_nothing_twice(example, tmp_path, monkeypatch):
    monkeypatch.setenv("NO_COLOR", "1")
    # The largest sheet has a point: with a body it is cut for most of a minute.
    profile = ["-p", "paper"] if "16x16" in example.stem else []
    words = [str(example), *profile, "--effort", "quick", "--fresh", "-o", str(tmp_path / "part.gcode")]
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert not ended.value.code
    made = specialisations()
    assert len(made) > 90
    assert [one for one, count in made.items() if count > 1] == []
