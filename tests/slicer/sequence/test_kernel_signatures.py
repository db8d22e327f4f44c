"""No kernel has more than eight parameters: what belongs together goes in a NamedTuple."""

import ast
from pathlib import Path

import pytest

SLICER = Path(__file__).parents[3] / "slicer"
MOST = 8
KERNELS = ("kernel", "bare_kernel", "inner_kernel", "allocating_inner_kernel")


def kernels(source: str) -> dict[str, int]:
    """The number of parameters of each compiled function of a module."""
    return {
        node.name: len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs])
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef)
        and any(isinstance(by, ast.Name) and by.id in KERNELS for by in node.decorator_list)
    }


@pytest.mark.parametrize(
    "module", sorted(SLICER.rglob("*.py")), ids=lambda path: str(path.relative_to(SLICER))
)
def test_no_kernel_has_more_than_eight_parameters(module):
    too_many = {name: count for name, count in kernels(module.read_text()).items() if count > MOST}
    assert not too_many


def test_kernels_are_found_and_their_parameters_counted():
    assert sum(len(kernels(module.read_text())) for module in SLICER.rglob("*.py")) > 80
    source = "@bare_kernel\ndef f(a, b, /, c, *, d):\n    pass\n\ndef g(a):\n    pass"
    assert kernels(source) == {"f": 4}
