import pickle
from pathlib import Path

import pytest
from covista_schemas.reports import GroupBounds, Hysteresis, LiveSettings
from covista_schemas.zenoh_tls import Tls
from covista_service.config import Address, Settings, SettingsError, load, parse_address, with_stored

LOCKED = {"zenoh_tls_ca": "ca.pem", "zenoh_tls_cert": "station.pem", "zenoh_tls_key": "station.key"}


@pytest.fixture(autouse=True)
def _clean_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in (*Settings.model_fields, *(f"hysteresis__{name}" for name in Hysteresis.model_fields)):
        monkeypatch.delenv(f"COVISTA_{name.upper()}", raising=False)


def test_defaults_are_those_of_the_contract() -> None:
    settings = load()
    assert (settings.api, settings.link, settings.site) == ("127.0.0.1:8000", ("tcp/127.0.0.1:7447",), "default")
    assert settings.database == "sqlite:///covista.db"
    assert settings.live == LiveSettings()
    assert settings.api_address == Address("127.0.0.1", 8000)


def test_flags_go_before_the_environment_before_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "station.toml"
    file.write_text('alpha = 0.1\nsite = "file"\nsigma = 2.5\ngroups = { min = 2, max = 4 }\nlink = ["tcp/[::1]:1"]\n')
    monkeypatch.setenv("COVISTA_ALPHA", "0.2")
    monkeypatch.setenv("COVISTA_SITE", "environment")
    settings = load({"alpha": 0.3}, file)
    assert (settings.alpha, settings.site, settings.sigma) == (0.3, "environment", 2.5)
    assert settings.groups == GroupBounds(min=2, max=4)
    assert settings.link == ("tcp/[::1]:1",)


def test_the_environment_says_lists_and_choices_as_text(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COVISTA_LINK", "tcp/127.0.0.1:1, tcp/127.0.0.1:2")
    monkeypatch.setenv("COVISTA_GROUPS", "3")
    monkeypatch.setenv("COVISTA_INSECURE", "true")
    monkeypatch.setenv("COVISTA_CONNECT", "")
    settings = load()
    assert settings.link == ("tcp/127.0.0.1:1", "tcp/127.0.0.1:2")
    assert (settings.groups, settings.insecure, settings.connect) == (3, True, ())


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("alpha", 2, "less than or equal to 1"),
        ("alpha", "nan", "Input should be"),
        ("groups", "many", "auto, a number of groups, or bounds"),
        ("groups", 0, "greater than or equal to 1"),
        ("sigma", -1, "greater than 0"),
        ("criterion", "best", "'adaptive', 'silhouette'"),
        ("grouping", "best", "'spectral', 'components' or 'distance'"),
        ("min_group_size", 0, "greater than or equal to 1"),
        ("workers", "dask", "'dask' is not threads, processes or dask://HOST:PORT"),
        ("workers", "dask://scheduler", "not threads, processes or dask://HOST:PORT"),
        ("workers", "dask://scheduler:0", "not threads, processes or dask://HOST:PORT"),
        ("workers", "dask://scheduler:65536", "port from 0 to 65535"),
        ("workers", "dask://:8786", "not threads, processes or dask://HOST:PORT"),
        ("workers", "dask://a b:8786", "not threads, processes or dask://HOST:PORT"),
        ("workers", "dask://scheduler:8786/path", "not threads, processes or dask://HOST:PORT"),
        ("workers", "tcp://scheduler:8786", "not threads, processes or dask://HOST:PORT"),
        ("workers_count", 0, "greater than or equal to 1"),
        ("api", "8000", "not HOST:PORT"),
        ("api", "127.0.0.1:70000", "port from 0 to 65535"),
        ("link", "127.0.0.1:7447", "not an end point such as tcp/127.0.0.1:7447"),
        ("link", "tcp/127.0.0.1", "not an end point"),
        ("site", "Main Site", "pattern"),
        ("database", "covista.db", "sqlite:///covista.db"),
        ("database", "postgresql://host:port/covista", "not a database URL"),
        ("log_level", "loud", "'debug'"),
        ("log_format", "xml", "'text' or 'json'"),
        ("log_lines_per_minute", -1, "greater than or equal to 0"),
        ("live_after_s", 0, "greater than 0"),
    ],
)
def test_a_setting_that_makes_no_sense_is_one_line_with_its_name(name: str, value: object, said: str) -> None:
    with pytest.raises(SettingsError) as caught:
        load({name: value})
    line = str(caught.value)
    assert line.startswith(f"setting {name} (")
    assert f"COVISTA_{name.upper()}" in line
    assert said in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"gone_after_s": 1000}, "setting forget_after_s = 600 must not be less than live_after_s"),
        ({"decay_after_s": 900}, "setting decay_after_s = 900 must not be more than unknown_after_s"),
        ({"link": ""}, "setting link is empty, and so is connect"),
        ({"zenoh_tls_ca": "ca.pem"}, "setting zenoh_tls_ca needs zenoh_tls_cert, zenoh_tls_key"),
        ({"zenoh_tls_robots": "robots.txt"}, "setting zenoh_tls_robots needs zenoh_tls_ca, zenoh_tls_cert"),
        ({"zenoh_tls_peers": "router"}, "setting zenoh_tls_peers needs zenoh_tls_ca, zenoh_tls_cert"),
        (LOCKED, r"setting link \(--link, COVISTA_LINK\): 'tcp/127.0.0.1:7447' is a plain end point"),
        (
            LOCKED | {"connect": "tcp/router:7447"},
            r"setting connect \(--connect, COVISTA_CONNECT\): 'tcp/router:7447' is",
        ),
        (LOCKED | {"link": "tls/0.0.0.0:7447"}, "setting zenoh_tls_ca needs zenoh_tls_robots"),
        ({"link": "tls/0.0.0.0:7447"}, r"'tls/0.0.0.0:7447' needs certificates .* \(zenoh_tls_ca, zenoh_tls_cert"),
    ],
)
def test_settings_that_contradict_each_other_are_named(values: dict[str, object], said: str) -> None:
    with pytest.raises(SettingsError, match=said):
        load(values)


def test_a_locked_link_has_three_files_and_a_list() -> None:
    settings = load(LOCKED | {"link": "tls/0.0.0.0:7447", "zenoh_tls_robots": "robots.txt", "zenoh_tls_peers": "a, b"})
    assert settings.zenoh_tls == Tls(Path("ca.pem"), Path("station.pem"), Path("station.key"))
    assert settings.zenoh_tls_peers == ("a", "b")
    assert load().zenoh_tls is None


def test_who_joins_a_router_listens_only_where_told(monkeypatch: pytest.MonkeyPatch) -> None:
    assert load(LOCKED | {"connect": "tls/router:7447"}).link == ()
    assert load({"connect": "tcp/router:7447", "link": "tcp/127.0.0.1:1"}).link == ("tcp/127.0.0.1:1",)
    monkeypatch.setenv("COVISTA_CONNECT", "tcp/router:7447")
    assert load().link == ()
    monkeypatch.setenv("COVISTA_LINK", "tcp/127.0.0.1:2")
    assert load().link == ("tcp/127.0.0.1:2",)


def test_an_unknown_key_of_the_file_is_named_with_those_that_are_known(tmp_path: Path) -> None:
    file = tmp_path / "station.toml"
    file.write_text("alhpa = 0.5\n")
    with pytest.raises(SettingsError, match=r"setting alhpa is not known; known are alpha, "):
        load({}, file)


@pytest.mark.parametrize("text", [b"alpha = .5\n", b"\xff\xfe"])
def test_a_file_that_is_not_toml_is_named(tmp_path: Path, text: bytes) -> None:
    file = tmp_path / "station.toml"
    file.write_bytes(text)
    with pytest.raises(SettingsError, match=r"--config .*station\.toml is not TOML"):
        load({}, file)


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="cannot be read: No such file"):
        load({}, tmp_path / "absent.toml")


def test_settings_travel_between_processes() -> None:
    settings = load({"groups": {"min": 1, "max": 2}})
    assert pickle.loads(pickle.dumps(settings)) == settings


@pytest.mark.parametrize("workers", ["threads", "processes", "dask://scheduler:8786", "dask://[::1]:8786"])
def test_workers_of_all_kinds(workers: str) -> None:
    assert load({"workers": workers}).workers == workers


def test_addresses_of_both_families() -> None:
    assert parse_address("[::1]:80") == Address("::1", 80)
    with pytest.raises(ValueError, match="not HOST:PORT"):
        parse_address("localhost:http")


def test_parts_of_a_setting_can_be_set_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "station.toml"
    file.write_text("[hysteresis]\npersistence_s = 2.0\n")
    assert load(file=file).hysteresis == Hysteresis(persistence_s=2.0)
    monkeypatch.setenv("COVISTA_HYSTERESIS__GAIN", "0.1")
    assert load().hysteresis == Hysteresis(gain=0.1)
    monkeypatch.setenv("COVISTA_GROUPS__MIN", "2")
    monkeypatch.setenv("COVISTA_GROUPS__MAX", "3")
    assert load().groups == GroupBounds(min=2, max=3)


@pytest.mark.parametrize(
    ("variable", "value", "said"),
    [
        ("HYSTERESIS__GAIN", "-1", "setting hysteresis.gain (COVISTA_HYSTERESIS__GAIN): Input should be greater than"),
        ("HYSTERESIS", '{"gain": "x"}', "setting hysteresis.gain (COVISTA_HYSTERESIS__GAIN): Input should be a valid"),
        ("HYSTERESIS", '{"colour": 1}', "Known are gain, persistence_s, smoothing."),
        (
            "HYSTERESIS",
            "gain=0.1",
            "setting hysteresis (COVISTA_HYSTERESIS): not JSON; or set a part of it, as COVISTA_HYSTERESIS__NAME",
        ),
    ],
)
def test_what_is_wrong_with_a_part_names_the_part(
    monkeypatch: pytest.MonkeyPatch, variable: str, value: str, said: str
) -> None:
    monkeypatch.setenv(f"COVISTA_{variable}", value)
    with pytest.raises(SettingsError) as caught:
        load()
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "text", ["https://control.example", "http://localhost:3000", "https://10.0.0.1:8443", "http://[::1]:80"]
)
def test_origins_of_pages_are_named_in_full(text: str) -> None:
    assert load({"cors_origins": f"{text}, https://other.example"}).cors_origins == (text, "https://other.example")


@pytest.mark.parametrize(
    "text",
    [
        *("*", "https://*.example", "control.example", "https://a.example/", "https://a.example/x", "ftp://a.example"),
        *("https://", "https://u@a.example", "https://a.example:x", "https://A.example", "https://a.example?b", "null"),
    ],
)
def test_what_is_no_origin_is_refused(text: str) -> None:
    with pytest.raises(SettingsError, match=r"setting cors_origins \(COVISTA_CORS_ORIGINS\): .* is not the origin"):
        load({"cors_origins": text})


@pytest.mark.parametrize(("given", "absent"), [("tls_cert", "tls_key"), ("tls_key", "tls_cert")])
def test_a_certificate_needs_its_key(given: str, absent: str) -> None:
    with pytest.raises(SettingsError, match=f"setting {given} needs {absent}"):
        load({given: "station.pem"})


def test_settings_are_shown_without_what_is_secret() -> None:
    settings = load(
        {
            "database": "postgresql://station:secret@db:5432/covista?sslpassword=secret",
            "connect": ["tls/router:7447#root_ca_certificate_base64=secret", "tcp/10.0.0.1:7447"],
        }
    )
    shown = settings.shown
    assert shown.keys() == type(settings).model_fields.keys()
    assert "secret" not in str(shown)
    assert shown["database"] == "postgresql://station:***@db:5432/covista"
    assert shown["connect"] == "tls/router:7447, tcp/10.0.0.1:7447"
    assert shown["alpha"] == "0.5"


def test_what_was_given_while_it_ran_goes_before_the_file_and_after_all_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "station.toml"
    file.write_text("alpha = 0.1\nmin_group_size = 2\nsigma = 2.5\n[hysteresis]\nsmoothing = 0.9\n")
    monkeypatch.setenv("COVISTA_SIGMA", "std")
    monkeypatch.setenv("COVISTA_HYSTERESIS__GAIN", "0.1")
    settings = load({"criterion": "gain"}, file)
    assert settings.pinned == {"criterion", "sigma", "hysteresis.gain"}
    given = {
        "alpha": 0.7,
        "sigma": 4.0,
        "criterion": "paper",
        "groups": {"min": 1, "max": 3},
        "hysteresis.gain": 0.3,
        "hysteresis.persistence_s": 2.0,
    }
    live = with_stored(settings, given).live
    assert (live.alpha, live.min_group_size, live.groups) == (0.7, 2, GroupBounds(min=1, max=3))
    assert (live.sigma, live.criterion) == ("std", "gain")
    assert live.hysteresis == Hysteresis(gain=0.1, persistence_s=2.0, smoothing=0.9)


def test_what_was_given_and_makes_no_sense_any_more_is_left_out_with_a_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    given = {"alpha": 7, "colour": "red", "hysteresis.colour": 1, "hysteresis.gain": None, "criterion": "gain"}
    assert with_stored(load(), given).live == LiveSettings(criterion="gain")
    assert [record.args for record in caplog.records] == [
        ("alpha",),
        ("colour",),
        ("hysteresis.colour",),
        ("hysteresis.gain",),
    ]


def test_what_is_pinned_travels_between_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COVISTA_ALPHA", "0.2")
    settings = pickle.loads(pickle.dumps(load({"groups": 3})))
    assert settings.pinned == {"alpha", "groups"}
    assert with_stored(settings, {"criterion": "gain"}).pinned == {"alpha", "groups"}
