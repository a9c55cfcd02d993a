"""The examples of docs/python.md, run in order in one interpreter, as a reader would."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[3] / "docs/python.md"


def test_the_examples_of_the_manual_run_and_print_what_they_say(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```(python|text)\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.S)
    assert sum(kind == "python" for kind, _ in blocks) >= 5
    names: dict = {}
    said = ""
    for kind, text in blocks:
        if kind == "python":
            exec(compile(text, str(DOCS), "exec"), names)  # the manual is ours
            said = capsys.readouterr().out
        else:
            for line in text.splitlines():
                assert line.strip() in said, (line, said)
