"""A run says when an observer left its Takagi-Sugeno model, and is silent when it did not."""

import pytest

import cosim


def run(speed: float) -> cosim.Outcome:
    s = cosim.Scenario(stop=1.0, step=0.1).set("certificates", "ignore")
    s.add("train", model="locomotive", parameters={"train_speed": speed, "wheel_rate": speed / 0.575})
    s.add("observer", observer="general_takagi_sugeno_cdo", parameters={"estimated_speed": speed})
    s.connect("train.wheel_speed -> observer.measured_odometer")
    s.balises(position="train.position", speed="train.speed", layout="instants", instants=[0.25, 0.65])
    return s.run()


def test_premises_outside_their_bounds_are_reported() -> None:
    (warning,) = [text for text in run(60.0).warnings if "Takagi-Sugeno" in text]  # the model is made for 5 to 50 m/s
    assert warning.startswith(
        "observer: what its Takagi-Sugeno model mixes linear ones by (a premise) was outside its bounds at 2 sample(s) "
        "and for 1 s"
    )


@pytest.mark.parametrize("speed", [20.0])
def test_inside_them_nothing_is_said(speed: float) -> None:
    assert [text for text in run(speed).warnings if "Takagi-Sugeno" in text] == []


def train_run(speed: float, observer: str = "takagi_sugeno_cdo", **parameters: float) -> cosim.Outcome:
    s = cosim.Scenario(stop=1.0, step=0.1).set("certificates", "ignore")
    s.add("train", model="locomotive", parameters={"train_speed": speed, "wheel_rate": speed / 0.575})
    s.add("observer", observer=observer, parameters={"estimated_speed": speed, **parameters})
    s.connect("train.wheel_speed -> observer.odometer")
    s.balises(position="train.position", speed="train.speed", layout="instants", instants=[0.25, 0.65])
    return s.run()


@pytest.mark.parametrize("observer", ["takagi_sugeno_cdo", "augmented_takagi_sugeno_cdo"])
def test_a_train_faster_than_its_vertices_is_found_from_the_recorded_odometer(observer: str) -> None:
    outcome = train_run(60.0, observer)
    (warning,) = [text for text in outcome.warnings if "Takagi-Sugeno" in text]
    assert warning.startswith(
        "observer: its Takagi-Sugeno model is made for odometer values up to 50 m/s; they were above for 1 s"
    )
    found = outcome.result.summary["premises"]["observer"]
    assert (found["premise"], found["bounds"], found["seconds_below"]) == ("odometer", [5.0, 50.0], 0.0)
    assert found["seconds_above"] == pytest.approx(1.0)


def test_a_slow_train_is_counted_without_a_warning() -> None:
    outcome = train_run(2.0)
    assert outcome.result.summary["premises"]["observer"]["seconds_below"] == pytest.approx(1.0)
    assert [text for text in outcome.warnings if "Takagi-Sugeno" in text] == []
    assert train_run(20.0).result.summary["premises"] == {}


def test_bounds_in_use_count() -> None:
    assert train_run(60.0, premise_max=80.0).result.summary["premises"] == {}


def test_an_observer_that_counts_time_only_is_reported_too() -> None:
    s = cosim.Scenario(stop=1.0, step=0.1)
    s.add("train", model="locomotive", parameters={"train_speed": 60.0, "wheel_rate": 60.0 / 0.575})
    s.add("observer", observer="takagi_sugeno_luenberger", options={"model": "takagi_sugeno_train"})
    s.connect("train.position -> observer.measured_position", "train.wheel_speed -> observer.measured_odometer")
    (warning,) = [text for text in s.run().warnings if "Takagi-Sugeno" in text]
    assert warning.startswith(
        "observer: what its Takagi-Sugeno model mixes linear ones by (a premise) was outside its bounds for 1 s"
    )
