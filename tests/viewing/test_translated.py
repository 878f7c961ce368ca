"""Every word of a view goes through the catalogues, and they are complete."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from string import Formatter

import pytest
from babel.messages.extract import DEFAULT_KEYWORDS, extract_from_dir
from babel.messages.frontend import parse_mapping_cfg
from babel.messages.pofile import read_po

from er3a.pipeline import language
from er3a.pipeline.language import KEYED
from er3a.pipeline.messages.say import english
from er3a.pipeline.overview.index import write_index
from er3a.pipeline.stages.registry import STAGES
from er3a.pipeline.stages.run import show
from er3a.pipeline.study import load_study
from er3a.pipeline.teach.panel import write_teach_page
from er3a.pipeline.viewing.figures import house_style
from testing.small_study import stages_of
from tests.conftest import ROBOTS, ROOT
from tests.viewing.untranslated import PageTexts, plain_words, texts_from_files, wide_letters

CHINESE = re.compile("[\u4e00-\u9fff]")
UPDATE = "`make words` collects texts; translate the new ones in er3a/pipeline/messages/locale"


@pytest.fixture(scope="module", params=language.LANGUAGES[1:])
def catalogue(request):
    with language.catalogue_file(request.param).open("rb") as file:
        return {(entry.context, *_forms(entry.id)): entry for entry in read_po(file) if entry.id}


@pytest.mark.long
def test_a_catalogue_has_the_texts_of_the_code_and_no_others(catalogue):
    with (ROOT / "er3a/pipeline/messages/locale/babel.cfg").open() as file:
        methods, options = parse_mapping_cfg(file)
    found = extract_from_dir(str(ROOT), methods, options, keywords={**DEFAULT_KEYWORDS, "tr": None})
    in_code = {(context, *_forms(message)) for _, _, message, _, context in found if message}
    assert in_code - set(catalogue) == set(), UPDATE
    assert set(catalogue) - in_code == set(), UPDATE


def test_each_entry_is_translated_with_all_its_fields(catalogue, request):
    for stage in STAGES.values():
        import_module(stage.messages)
    for texts, entry in catalogue.items():
        translated = _forms(entry.string)
        texts = (english(entry.id),) if entry.context == KEYED else texts
        assert not entry.fuzzy, texts
        assert all(translated), f"not translated: {texts}"
        for text in translated:
            assert _fields(text) == _fields(texts[-1]), f"other fields: {text}"
            in_chinese = CHINESE.search(text) or not re.search(r"[a-z]{4,}", _without_fields(texts[-1]))
            assert in_chinese or "zh" not in request.node.name, texts


@pytest.fixture(scope="module")
def own_texts(small_study):
    data = small_study.folder / "data"
    files = {path.relative_to(small_study.folder).as_posix() for path in data.rglob("*.*")}
    names = {*ROBOTS, "GOAL"}  # as KRL reads it
    texts = texts_from_files(data) | texts_from_files(small_study.folder / "config")
    shortened = {re.split("[,，]", text)[0] for text in texts}  # titles of documents, in drawings
    return files | texts | shortened | names


# All stages of one arm; of others what it has not: a table that evidence contradicts, a drawing of the workspace.
KINDS = [(stage, "er3a_c60") for stage in stages_of("er3a_c60")]
KINDS += [("validation", "er3a_c60_article"), ("validation", "er3_600"), ("workspace", "er3_600")]


@pytest.mark.parametrize(("stage", "name"), KINDS)
def test_each_word_of_a_stage_s_page_can_be_translated(stage, name, small_study, own_texts, tmp_path, monkeypatch):
    monkeypatch.chdir(small_study.folder)
    study, page = load_study("config/small.yaml"), tmp_path / "page.html"
    with wide_letters() as shown, house_style():
        show("report", stage, study, name, Path("results") / name / stage, page)
    assert plain_words([*PageTexts(page.read_text(encoding="utf-8")).texts, *shown], own_texts) == []


def test_each_word_of_the_other_pages_can_be_translated(small_study, own_texts, tmp_path, monkeypatch):
    monkeypatch.chdir(small_study.folder)
    study = load_study("config/small.yaml")
    with wide_letters():
        write_index(study, Path("results"), tmp_path)
        for name in small_study.robots:
            write_teach_page(study, name, Path("results"), tmp_path / f"{name}.html")
    for page in tmp_path.glob("*.html"):
        assert plain_words(PageTexts(page.read_text(encoding="utf-8")).texts, own_texts) == [], page.name


def _forms(text: str | tuple[str, ...]) -> tuple[str, ...]:
    return (text,) if isinstance(text, str) else tuple(text)


def _fields(text: str) -> set[str]:
    named = {name for _, name, _, _ in Formatter().parse(re.sub(r"\{\{|\}\}", "", text)) if name}
    return named | set(re.findall(r"%\((\w+)\)s", text))


def _without_fields(text: str) -> str:
    return re.sub(r"\{[^}]*\}|%\(\w+\)s|<[^>]*>", "", text)
