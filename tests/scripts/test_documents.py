"""README, CHANGELOG and manifest say what is so."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from bubble_pattern_addon.core.field_tables import KINDS
from bubble_pattern_addon.core.field_tables import READERS as FIELD_READERS
from bubble_pattern_addon.core.recipe import Recipe
from bubble_pattern_addon.core.recipe_file import READERS, recipe_from_dict

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_the_version_stands_in_the_manifest_alone_and_is_the_newest_of_the_changelog() -> None:
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text("utf-8"))["version"]
    newest = re.search(r"^## (\d+\.\d+\.\d+)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert newest is not None
    assert newest[1] == version
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert "version" not in project


def test_every_link_of_the_readme_leads_somewhere() -> None:
    links = [link for link in re.findall(r"\]\(([^)]+)\)", README) if "://" not in link]
    assert links
    assert [link for link in links if not (ROOT / link).exists()] == []


@pytest.mark.parametrize("script", sorted(set(re.findall(r"python3 (scripts/\w+\.py)", README))))
def test_every_script_of_the_readme_can_be_called(script: str) -> None:
    done = subprocess.run(
        [sys.executable, str(ROOT / script), "--help"], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0
    assert done.stdout.startswith(f"usage: {Path(script).name}")


def test_pictures_are_small() -> None:
    pictures = [*ROOT.glob("docs/*.jpg"), *ROOT.glob("docs/*.png")]
    assert pictures
    assert [picture.name for picture in pictures if picture.stat().st_size > 300_000] == []


def test_the_readme_s_recipe_is_one() -> None:
    recipes = blocks("toml")
    assert recipes
    for text in recipes:
        recipe_from_dict(tomllib.loads(text))


def test_the_readme_s_table_has_every_key_under_its_table_and_no_other() -> None:
    told: dict[str, set[str]] = {}
    section = ""
    for row in re.findall(r"^\| (`\[\w+\]`)? ?\| `(\w+)", README, re.MULTILINE):
        section = row[0].strip("`[]") or section
        told.setdefault(section, set()).add(row[1])
    assert told == {section: set(readers) for section, readers in READERS.items()}


def test_the_readme_names_every_kind_of_field_and_every_key_of_it() -> None:
    text = README[README.index("**Fields.**") : README.index("## For developers")]
    named = set(re.findall(r"`([a-z]+)`", text)) | set(re.findall(r"(\w+) = ", text))
    keys = {key for key in FIELD_READERS if key not in named}
    assert keys == set()
    assert [kind for kind in KINDS if kind not in named] == []


def test_the_readme_s_defaults_are_the_recipe_s() -> None:
    recipe, section, compared = Recipe(), "", 0
    for row in re.findall(r"^\| (`\[\w+\]`)? ?\| `(\w+).*\| ([^|]+) \|$", README, re.MULTILINE):
        section = row[0].strip("`[]") or section
        default = getattr(getattr(recipe, section), row[1])
        if isinstance(default, (int, float)) and not isinstance(default, bool):
            assert float(row[2]) == default, row[1]
            compared += 1
        elif isinstance(default, str):
            assert row[2] == f'`"{default}"`', row[1]
            compared += 1
    assert compared >= 9


def test_the_readme_s_commands_name_scripts_that_are_there() -> None:
    scripts = set(re.findall(r"scripts/\w+\.py", README))
    assert {"scripts/demo.py", "scripts/test.py", "scripts/pattern_batch.py"} <= scripts
    assert [script for script in scripts if not (ROOT / script).exists()] == []
