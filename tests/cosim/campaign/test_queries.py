"""The queries of the guide do what they say they do, on the campaign that stands there."""

from __future__ import annotations

from pathlib import Path

import pytest

from cosim import Scenario

PAGE = Path(__file__).parents[3] / "docs" / "guide" / "campaigns.md"


@pytest.mark.slow
def test_the_queries_of_the_guide_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    duckdb = pytest.importorskip("duckdb")
    page = PAGE.read_text(encoding="utf-8")
    (tmp_path / "night.toml").write_text(page.partition("```toml\n")[2].partition("```")[0])
    table = Scenario.load(tmp_path / "night.toml").campaign(runs=5).run(tmp_path / "out", progress=False).to_pandas()
    monkeypatch.chdir(tmp_path / "out")
    database = duckdb.connect()
    database.execute("CREATE VIEW runs AS SELECT * FROM read_parquet('parts/*.parquet', union_by_name = true)")
    queries = [query for query in page.partition("```text\n")[2].partition("```")[0].split(";") if query.strip()]
    answers = [database.execute(query).fetchall() for query in queries]
    error = table["observer.position_error_max"]
    assert len(answers) == 10
    assert answers[0] == [(10, 0)]
    assert answers[2][0][1:] == (error.idxmax(), error.max())
    assert answers[3][0][0][0] == pytest.approx(error.median())
    assert [row[1] for row in answers[4]] == pytest.approx(list(error.groupby(table["design"]).median()))
