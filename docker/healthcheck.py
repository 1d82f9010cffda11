"""Exit code 0 while the station says that it is ready or degraded; asks where REST listens, with TLS or without."""

import os
import ssl
import sys
from http.client import HTTPConnection, HTTPException, HTTPSConnection

address = os.environ.get("COVISTA_API") or "127.0.0.1:8000"
host, _, port = address.rpartition(":")
host = host.strip("[]")
try:
    if os.environ.get("COVISTA_TLS_CERT"):
        # It asks itself, by whatever name: there is nobody to be mistaken for.
        trusting = ssl._create_unverified_context()
        station = HTTPSConnection(host, int(port), timeout=3, context=trusting)
    else:
        station = HTTPConnection(host, int(port), timeout=3)
    station.request("GET", "/readyz")
    status = station.getresponse().status
except (OSError, HTTPException) as error:
    sys.exit(f"no answer at {address}: {error}")
if status != 200:
    sys.exit(f"{address}/readyz answers {status}")
