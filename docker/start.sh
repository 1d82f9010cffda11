#!/bin/sh
# Runs what it is given, with compiled code where it can be written: where it cannot, numba looks at none and compiles anew.
set -eu
if [ ! -w "$NUMBA_CACHE_DIR" ]; then
  cp -R "$NUMBA_CACHE_DIR" /tmp/numba
  export NUMBA_CACHE_DIR=/tmp/numba
fi
exec "$@"
