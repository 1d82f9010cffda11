#!/usr/bin/env bash
# Prints the name of the image to build on: the public Python image, or where it cannot be pulled an equal base that is made
# here from Debian's packages. BASE_IMAGE, in the environment or in docker/.env, overrules it;
# `docker rmi covista-base:bookworm` has the self-made one made anew.
set -euo pipefail

public=python:3.11-slim-bookworm
made=covista-base:bookworm
include=python3,python3-venv,ca-certificates

say() { echo "base.sh: $*" >&2; }
is_here() { docker image inspect "$1" >/dev/null 2>&1; }

asked=${BASE_IMAGE:-$(sed -n "s/^BASE_IMAGE=[\"']\{0,1\}\([^\"' ]*\).*/\1/p" "$(dirname "$0")/.env" 2>/dev/null | tail -n 1 || true)}
if [ -n "$asked" ]; then
  echo "$asked"
  exit
fi
for image in "$public" "$made"; do
  if is_here "$image"; then
    echo "$image"
    exit
  fi
done
if timeout 300 docker pull --quiet "$public" >/dev/null 2>&1; then
  echo "$public"
  exit
fi

if command -v mmdebstrap >/dev/null; then tool=mmdebstrap
elif command -v debootstrap >/dev/null; then tool=debootstrap
else
  say "$public cannot be pulled: install mmdebstrap or debootstrap to make a base from Debian's packages"
  exit 1
fi
say "$public cannot be pulled: making $made with $tool"

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
root=$scratch/root

# Where the network presents a certificate authority of its own, pip in the container must know it as the host does.
bundle=${PIP_CERT:-${SSL_CERT_FILE:-/etc/ssl/certs/ca-certificates.crt}}
trusted=etc/ssl/certs/ca-certificates.crt
settings=(--change 'CMD ["python3"]')
if [ -f "$bundle" ]; then settings+=(--change "ENV PIP_CERT=/$trusted"); fi

if [ "$tool" = mmdebstrap ]; then
  mmdebstrap --quiet --variant=minbase --include="$include" bookworm "$root" >&2
else
  debootstrap --variant=minbase --include="$include" bookworm "$root" >"$scratch/log" 2>&1 || { tail -n 20 "$scratch/log" >&2; exit 1; }
fi
if [ -f "$bundle" ]; then cp --dereference "$bundle" "$root/$trusted"; fi
rm -rf "$root"/var/cache/apt/archives/*.deb "$root"/var/lib/apt/lists/* "$root"/usr/share/{doc,man,locale}
tar --create --numeric-owner --one-file-system --directory "$root" . | docker import "${settings[@]}" - "$made" >/dev/null
echo "$made"
