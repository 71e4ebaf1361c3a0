"""Calls of scripts: a mistake is refused at the call in one line, and changes nothing; nothing else is refused."""

from __future__ import annotations

import importlib.util
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cosim import Scenario, shipped_scenarios
from cosim.errors import CosimError
from cosim.expectations.registry import EXPECTATIONS
from cosim.scenario.campaign_table import CampaignTable
from cosim.scenario.network_table import NetworkTable
from cosim.scenario.scenario_tables import BalisesTable, ComponentTable, ConnectionTable, MasterTable, ReportTable
from cosim.scenario.schema import ScenarioTable
from cosim.scenario.shipped import shipped_tables

BALISES = {
    "position": "train.position",
    "speed": "train.speed",
    "layout": "spacing",
    "spacing": 20.0,
    "track_end": 500.0,
}
ROOT = Path(__file__).resolve().parents[3]


def stated() -> Scenario:
    s = Scenario(stop=10.0, step=0.01)
    s.add("train", model="locomotive").add("driver", model="driver")
    s.add("observer", observer="discrete_uio", parameters={"mass": 80e3})
    return s.connect("driver.effort -> train.effort, observer.effort", "train.wheel_speed -> driver.odometer")


Call = Callable[[Scenario], Any]
MISTAKES: dict[str, tuple[Call, str]] = {
    "step negative": (lambda _: Scenario(stop=10.0, step=-0.01), r"step must be positive, got -0.01 s"),
    "step set negative": (lambda s: s.set("step", -0.01), r"step must be positive, got -0.01 s"),
    "step that does not divide": (lambda _: Scenario(stop=10.0, step=0.03), r"use stop = 9.99 or 10.02"),
    "misspelt key of the scenario": (lambda _: Scenario(stop=10.0, stepp=0.01), r"stepp: unknown key.*'step'"),
    "text for a number": (lambda _: Scenario(stop="ten", step=0.01), r"stop: .*number.*\"ten\""),
    "misspelt key of a component": (
        lambda s: s.add("second", model="locomotive", preste="x"),
        r"components.second.preste: unknown key; did you mean 'preset'",
    ),
    "unknown model": (lambda s: s.add("second", model="locomotve"), r"unknown model 'locomotve'.*'locomotive'"),
    "plant for an observer": (lambda s: s.add("second", observer="locomotive"), r"write model = 'locomotive'"),
    "unknown preset": (
        lambda s: s.add("second", model="locomotive", preset="chapter_4"),
        r"components.second: locomotive has no preset 'chapter_4'; did you mean 'chapter_3'",
    ),
    "unknown parameter": (
        lambda s: s.add("second", model="locomotive", parameters={"mas": 80e3}),
        r"second: no variable 'mas'; did you mean 'mass'",
    ),
    "parameter set that is unknown": (lambda s: s.set("train.mas", 80e3), r"train: no variable 'mas'.*'mass'"),
    "parameter out of range": (
        lambda s: s.add("second", model="locomotive", parameters={"mass": -1.0}),
        r"second.mass: -1 lies outside what the component declares: 1.0 to inf kg",
    ),
    "missing FMU": (lambda s: s.add("second", fmu="vendr.fmu"), r"components.second: there is no .*vendr.fmu"),
    "missing recording": (lambda s: s.add("second", recording="x.csv"), r"components.second: there is no .*x.csv"),
    "nothing to be": (lambda s: s.add("second"), r"components.second: give exactly one of 'fmu'"),
    "component twice": (lambda s: s.add("train", model="locomotive"), r"there is a component 'train' already"),
    "unknown output": (lambda s: s.connect("train.sped -> observer.odometer"), r"no variable 'sped'.*'speed'"),
    "unknown input": (lambda s: s.connect("train.speed -> observer.odomter"), r"no variable 'odomter'.*'odometer'"),
    "unknown output of one that comes later": (
        lambda s: s.connect("train.sped -> later.odometer"),
        r"no variable 'sped'.*'speed'",
    ),
    "no arrow": (lambda s: s.connect("train.speed observer.odometer"), r"line 3: .* is not 'source.signal ->"),
    "other unit": (
        lambda s: s.connect("train.position -> observer.odometer"),
        r"train.position -> observer.odometer: units 'm' and 'm/s' do not fit",
    ),
    "two sources": (
        lambda s: s.connect("train.speed -> driver.odometer"),
        r"Input driver.odometer has two sources, train.wheel_speed and train.speed",
    ),
    "misspelt keyword of a connection": (
        lambda s: s.connect("train.speed -> observer.odometer", facotr=2.0),
        r"facotr: unknown key; did you mean 'factor'",
    ),
    "balises without position": (
        lambda s: s.balises(layout="spacing", spacing=20.0, track_end=500.0),
        r"balises: layout 'spacing' needs 'position' and 'speed'",
    ),
    "balises without layout": (
        lambda s: s.balises(position="train.position", speed="train.speed"),
        r"balises.layout: is missing; the first call of balises\(\) states all that belongs together",
    ),
    "misspelt key of balises": (lambda s: s.balises(**BALISES, latncy=1.0), r"balises.latncy: .*'latency'"),
    "latency negative": (
        lambda s: s.balises(**BALISES, latency=-1.0),
        r"latency: expected at least 0 \(got -1",
    ),
    "unknown position": (
        lambda s: s.balises(**BALISES | {"position": "train.positon"}),
        r"balises.position: train: no variable 'positon'; did you mean 'position'",
    ),
    "position without component": (
        lambda s: s.balises(**BALISES | {"position": "position"}),
        r"balises.position: expected 'component.signal' \(got 'position'\)",
    ),
    "speed for a position": (lambda s: s.balises(**BALISES | {"position": "train.speed"}), r"train.speed is not in m "),
    "misspelt word": (lambda s: s.master(algorithm="jacoby"), r"master.algorithm: .*; did you mean 'jacobi'"),
    "misspelt key of the master": (lambda s: s.master(algoritm="jacobi"), r"master.algoritm: .*'algorithm'"),
    "unknown role": (lambda s: s.report(true_sped="train.speed"), r"report.true_sped: unknown key.*'true_speed'"),
    "role of an unknown signal": (lambda s: s.report(true_speed="train.sped"), r"report.true_speed: .*'speed'"),
    "node with an unknown signal": (
        lambda s: s.network(nodes={"front": ["train.sped"]}, period=0.1),
        r"network.nodes.front: train: no variable 'sped'",
    ),
    "network without times": (lambda s: s.network(nodes={"front": ["train.speed"]}), r"network: give either 'period'"),
    "unknown component": (lambda s: s.set("trian.mass", 1.0), r"no component 'trian'; did you mean 'train'"),
    "unknown check": (lambda s: s.expect("sped_error", max=1.0), r"unknown check 'sped_error'.*'speed_error'"),
    "misspelt key of a check that needs it": (
        lambda s: s.expect("signal", sgnal="train.speed", max=1.0),
        r"expect, number 1, 'signal', sgnal: unknown key; did you mean 'signal'",
    ),
    "misspelt signal of a check": (
        lambda s: s.expect("signal", signal="train.sped", max=1.0),
        r"expect, number 1, 'signal', signal: train: no variable 'sped'; did you mean 'speed'",
    ),
    "check of a component alone": (
        lambda s: s.expect("difference", signal="train.speed", reference="train", max=1.0),
        r"'difference', reference: expected 'component.signal' \(got 'train'\)",
    ),
    "misspelt key of a check": (lambda s: s.expect("speed_error", maxx=1.0), r"maxx: unknown key.*'max'"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_refused_at_the_call_in_one_line_and_changes_nothing(mistake: str) -> None:
    call, said = MISTAKES[mistake]
    scenario = stated()
    before = scenario.to_toml()
    with pytest.raises(CosimError, match=f"^script: .*{said}") as refused:
        call(scenario)
    assert "\n" not in str(refused.value)
    assert scenario.to_toml() == before


@pytest.mark.compiler
@pytest.mark.parametrize("name", [name for name in shipped_scenarios() if name != "own_fmu"])
def test_what_ships_is_stated_call_by_call_and_nothing_is_refused(name: str) -> None:
    """Each scenario file, as a script would state it; whatever the order, the tables are those of the file."""
    shipped = Scenario.load(name)
    tables = shipped_tables(name)
    if "include" in tables:
        tables = dict(shipped._data)
    later = {"balises", "network", "master", "report", "components", "connections", "expect"}
    s = Scenario(folder=shipped.folder, **{key: value for key, value in tables.items() if key not in later})
    s.connect(*tables.get("connections", [])[:1])
    for component, table in tables["components"].items():
        s.add(component, **table)
    s.connect(*tables.get("connections", [])[1:])
    for key in ("balises", "network", "master", "report"):
        if key in tables:
            getattr(s, key)(**tables[key])
    for expected in tables.get("expect", []):
        s.expect(**expected)
    assert s.table() == shipped.table()
    for key, value in tables.items():
        s.set(key, value)
    for component, table in tables["components"].items():
        for parameter, value in [*table.get("parameters", {}).items()][:1]:
            s.set(f"{component}.{parameter}", value)
        for key in table.keys() & {"preset", "label", "model", "observer"}:
            s.set(f"{component}.{key}", table[key])
    assert s.table() == shipped.table()


def test_what_a_later_call_may_bring_is_left_to_the_run() -> None:
    s = Scenario(stop=0.1, step=0.01).add("train", model="locomotive")
    s.connect("train.wheel_speed -> observer.odometer").report(
        observers=["observer"], odometer="observer.odometer_speed"
    )
    s.balises(**BALISES, receivers=["observer"])
    with pytest.raises(CosimError, match=r"'observer.odometer'"):
        s.structure()
    s.add("observer", observer="discrete_uio", parameters={"mass": 80e3})
    s.structure()


def test_values_that_fit_only_together_are_set_one_by_one() -> None:
    s = stated().balises(**BALISES)
    s.set("balises.layout", "positions").set("balises.positions", [5.0, 10.0]).set("step", 0.03).set("stop", 0.3)
    s.set("observer.observer", "odometer_reset").set("observer.parameters", {})
    table = s.table()
    assert table.balises is not None
    assert table.balises.positions == [5.0, 10.0]


def test_a_connection_takes_what_happens_on_the_way_as_keywords() -> None:
    words = stated().connect("train.speed -> observer.odometer, later.odometer", factor=3.6, units="ignore")
    table = {"from": "train.speed", "factor": 3.6, "units": "ignore"}
    lines = ScenarioTable.model_validate(
        {**words._data, "connections": [*stated()._data["connections"], *({**table, "to": t} for t in TARGETS)]}
    )
    assert words.table().connections == lines.connections


TARGETS = ("observer.odometer", "later.odometer")

METHODS: dict[str, tuple[list[Any], set[str]]] = {
    "__init__": ([ScenarioTable], set()),
    "add": ([ComponentTable], set()),
    "connect": ([ConnectionTable], {"source", "target"}),
    "balises": ([BalisesTable], set()),
    "network": ([NetworkTable], set()),
    "master": ([MasterTable], set()),
    "report": ([ReportTable], set()),
    "campaign": ([CampaignTable], set()),
    "expect": ([EXPECTATIONS[name] for name in EXPECTATIONS], {"check"}),
}
OWN = {"self", "name", "lines", "check", "folder", "where"}


@pytest.mark.parametrize("method", METHODS)
def test_signatures_and_help_name_the_keys_of_the_tables(method: str) -> None:
    tables, left_out = METHODS[method]
    function = getattr(Scenario, method)
    keys = {key for table in tables for key in table.model_fields} - left_out
    assert keys - OWN == set(inspect.signature(function).parameters) - OWN
    assert all(f"``{key}``" in str(inspect.getdoc(function)) for key in keys)


def test_the_types_for_completion_are_those_of_the_tables() -> None:
    path = ROOT / "docs" / "keyword_types.py"
    spec = importlib.util.spec_from_file_location("keyword_types", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.STUB.read_text(encoding="utf-8") == module.stub()
