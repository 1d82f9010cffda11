#!/bin/sh
# Runs what it is given, with compiled code where it can be written: where it cannot, numba looks at none and compiles anew.
# Before that it writes the database's password where libpq looks for it, if it stands in a file.
set -eu
if [ ! -w "$NUMBA_CACHE_DIR" ]; then
  cp -R "$NUMBA_CACHE_DIR" /tmp/numba
  export NUMBA_CACHE_DIR=/tmp/numba
fi
if [ -n "${COVISTA_POSTGRES_PASSWORD_FILE:-}" ]; then
  password=$(sed 's/[\\:]/\\&/g' "$COVISTA_POSTGRES_PASSWORD_FILE")
  (umask 077 && rm -f "$PGPASSFILE" && printf '*:*:*:*:%s\n' "$password" >"$PGPASSFILE")
fi
exec "$@"
