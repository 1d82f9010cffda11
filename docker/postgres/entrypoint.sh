#!/bin/sh
# Makes the cluster at the first start, as the public image does: POSTGRES_USER with POSTGRES_PASSWORD, or what stands in
# POSTGRES_PASSWORD_FILE, and POSTGRES_DB. It is made beside and comes to its place whole: a start that is cut short
# leaves nothing that the next takes for a cluster.
set -eu
# What lies in the volume itself was made by a former version.
if [ ! -s "$PGDATA/PG_VERSION" ]; then
  volume=$PGDATA
  export PGDATA=$volume/cluster
fi
if [ ! -s "$PGDATA/PG_VERSION" ]; then
  password=${POSTGRES_PASSWORD:-}
  if [ -n "${POSTGRES_PASSWORD_FILE:-}" ]; then password=$(cat "$POSTGRES_PASSWORD_FILE"); fi
  if [ -z "$password" ]; then
    echo "postgres: neither POSTGRES_PASSWORD nor POSTGRES_PASSWORD_FILE has a password" >&2
    exit 1
  fi
  rm -rf "$volume/new"
  printf '%s\n' "$password" | initdb --pgdata="$volume/new" --username="$POSTGRES_USER" --pwfile=/dev/stdin \
    --auth-local=trust --auth-host=scram-sha-256 --encoding=UTF8 --locale=C.UTF-8 >/dev/null
  echo "host all all all scram-sha-256" >>"$volume/new/pg_hba.conf"
  echo "CREATE DATABASE $POSTGRES_DB" | postgres --single -D "$volume/new" -j postgres >/dev/null
  sync
  mv "$volume/new" "$PGDATA"
fi
exec postgres -c listen_addresses='*' -c unix_socket_directories=/run/postgresql
