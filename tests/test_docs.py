"""What the documents say of themselves: their links, and the numbers of docs/how-it-works.md."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = [*sorted(ROOT.glob("*.md")), *sorted(ROOT.glob("docs/*.md"))]
PAGE = ROOT / "docs" / "how-it-works.md"
NUMBER = re.compile(r"\d+(?:\.\d+)?")
SCRIPT = ROOT / "docs" / "how_it_works.py"


@pytest.fixture(scope="module")
def script():
    """The module that states the numbers, with those beside it, as where it is run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(SCRIPT.parent)
        return importlib.import_module(SCRIPT.stem)


def prose(file):
    """A document without its blocks of code."""
    return re.sub(r"^```.*?^```", "", file.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors(file):
    """The anchors of a document's headings, as GitHub makes them."""
    heads = re.findall(r"^#+ (.*)$", prose(file), flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def links(file):
    """What a document links to, without what is inside code."""
    return re.findall(r"\]\(([^()\s]+)\)", re.sub(r"`[^`]*`", "", prose(file)))


@pytest.mark.parametrize("file", DOCS, ids=lambda file: file.name)
def test_links_lead_somewhere(file):
    for link in links(file):
        if re.match(r"[a-z]+:", link):
            continue
        place, _, anchor = link.partition("#")
        target = file.parent / place if place else file
        assert target.exists(), f"{file.name}: {link}"
        assert not anchor or anchor in anchors(target), f"{file.name}: {link}"


def test_places_in_the_code_exist():
    """Whatever the page names as a folder or module is there."""
    names = [name for name in re.findall(r"`([\w/]+(?:/|\.py|\.json))`", prose(PAGE)) if "/" in name]
    assert len(names) > 15
    for name in names:
        inside = name if (ROOT / name).exists() else f"slicer/sequence/{name}"
        assert (ROOT / inside).exists(), name


def test_numbers_are_those_of_the_code(script):
    # The last section was measured on a machine, with date.
    text = " ".join(prose(PAGE).partition("## What each stage takes")[0].split())
    told = [" ".join(fact.split()) for fact in script.facts()]
    missing = [fact for fact in told if fact not in text]
    assert not missing
    # And none but those, of all that have a decimal point or more than two digits.
    for fact in told:
        text = text.replace(fact, "")
    for fact in script.rounds():
        match = re.search(NUMBER.sub(NUMBER.pattern.replace("\\", "\\\\"), re.escape(fact)), text)
        assert match, fact
        for written, found in zip(NUMBER.findall(match[0]), NUMBER.findall(fact), strict=True):
            assert float(written) == pytest.approx(float(found), rel=0.02, abs=0.5), fact
        text = text.replace(match[0], "")
    assert not re.findall(r"\d+[.,]\d+|\d{3,}", re.sub(r"`[^`]*`", "", text))


def test_pictures_are_those_that_are_drawn(script, tmp_path):
    drawn = script.draw(tmp_path)
    shown = [link for link in links(PAGE) if link.startswith("images/")]
    assert sorted(shown) == sorted(f"images/{path.name}" for path in drawn)
    for path in drawn:
        kept = ROOT / "docs" / "images" / path.name
        assert kept.stat().st_size < 150_000
        assert content(kept) == content(path)


def content(file):
    """The words of a picture, and how many marks of each colour it has; not how they are written."""
    text = file.read_text(encoding="utf-8")
    colors = sorted(set(re.findall(r"(?:stroke|fill): (#\w{6})", text)))
    return re.findall(r"<text[^>]*>([^<]*)", text), [(color, text.count(color)) for color in colors]


def test_depths_of_the_nozzle_page_are_those_of_its_script(tmp_path, capsys):
    spec = importlib.util.spec_from_file_location("nozzle", ROOT / "docs" / "nozzle.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main(tmp_path)
    page = (ROOT / "docs" / "nozzle.md").read_text(encoding="utf-8")
    said = re.findall(r"\d\.\d\d mm", capsys.readouterr().out)
    assert len(said) == 4
    for depth in said:
        assert depth in page
    for drawn in tmp_path.iterdir():
        assert (ROOT / "docs" / "images" / drawn.name).read_bytes() == drawn.read_bytes()
