"""A robot that was let in does not stay when its certificate is over."""

from pathlib import Path

import zenoh
from covista_schemas.zenoh_config import config

from tests.service.deadline import free_endpoint, wait_until
from tests.system.certificates import make_certificates, sign_for, tls_of

# Certificates are over at a whole second.
GOOD_FOR_S = 6


def test_the_link_ends_with_the_certificate(tmp_path: Path) -> None:
    endpoint = free_endpoint().replace("tcp/", "tls/")
    certs = make_certificates(tmp_path, "r1")
    with zenoh.open(config("router", listen=[endpoint], tls=tls_of(certs, "station"))) as station:
        short = sign_for(certs, "r1", GOOD_FOR_S)
        with zenoh.open(config("client", connect=[endpoint], tls=short)) as robot:
            heard: list[zenoh.Sample] = []
            station.declare_subscriber("said", heard.append)
            wait_until(lambda: robot.put("said", "") or heard, "it is heard")
            wait_until(lambda: not robot.info.transports(), "the link has ended", 20.0)
            wait_until(lambda: not station.info.transports(), "on both sides", 20.0)
