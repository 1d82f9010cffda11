#!/usr/bin/env bash
# Makes what a locked door needs, for trying things out: an authority, and certificates for the station, a router
# and robots. What is there already stays as it is, so robots can be added later:
#
#     docker/certs.sh FOLDER [ROBOT...]
#
# FOLDER gets ca.pem, ca.key, station.pem, station.key, router.pem, router.key, ROBOT.pem and ROBOT.key for each robot,
# and robots.txt, the list of robots that are let in. Keys can be read by their owner only (mode 600); called by root,
# the owner of those that it makes, but for ca.key, is uid 10001 (COVISTA_CERTS_UID), which the containers run as.
#
# COVISTA_CERTS_DAYS   how long certificates are good (825); the authority is good for ten years
# COVISTA_CERTS_HOSTS  more names and addresses that station and router are reached by, separated by commas
set -euo pipefail
umask 077

folder="${1:?usage: docker/certs.sh FOLDER [ROBOT...]}"
shift
days="${COVISTA_CERTS_DAYS:-825}"
owner="${COVISTA_CERTS_UID:-10001}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

fail() {
    echo "certs.sh: $1" >&2
    exit 1
}

say() {
    "$@" 2>"$work/said" || fail "openssl: $(tr '\n' ' ' <"$work/said")"
}

key() {
    say openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:prime256v1 -out "$1"
}

# Whether a file is there. Docker makes a folder where it is to mount a file that is missing.
there() {
    if [ ! -e "$1" ]; then return 1; fi
    if [ ! -f "$1" ]; then fail "$1 is no file; docker makes a folder where it finds none to mount: remove it"; fi
    if [ ! -s "$1" ]; then fail "$1 is empty: remove it, or put back what it was"; fi
}

# Whether NAME has a certificate and its key. One alone is somebody's, and no other is made in its place.
pair() {
    if there "$folder/$1.pem"; then
        there "$folder/$1.key" || fail "$folder has $1.pem and no $1.key: put it back, or take both away"
    else
        if there "$folder/$1.key"; then fail "$folder has $1.key and no $1.pem: put it back, or take both away"; fi
        return 1
    fi
}

# Into the folder, both at once: a certificate that all may read, and its key.
bring() {
    chmod 644 "$work/$1.pem"
    mv "$work/$1.key" "$folder/$1.key"
    mv "$work/$1.pem" "$folder/$1.pem"
}

authority() {
    if pair ca; then return; fi
    key "$work/ca.key"
    cat >"$work/ca.cnf" <<END
[req]
distinguished_name = name
x509_extensions = authority
prompt = no
[name]
CN = Covista trial authority
[authority]
basicConstraints = critical, CA:TRUE, pathlen:0
keyUsage = critical, keyCertSign, cRLSign
subjectKeyIdentifier = hash
END
    say openssl req -x509 -new -key "$work/ca.key" -sha256 -days 3650 -config "$work/ca.cnf" -out "$work/ca.pem"
    bring ca
}

# NAME, extended usage, subject alternative names
certificate() {
    if pair "$1"; then return; fi
    key "$work/$1.key"
    cat >"$work/$1.cnf" <<END
basicConstraints = critical, CA:FALSE
keyUsage = critical, digitalSignature
extendedKeyUsage = $2
subjectAltName = $3
subjectKeyIdentifier = hash
authorityKeyIdentifier = keyid
END
    say openssl req -new -key "$work/$1.key" -subj "/CN=$1" -out "$work/$1.csr"
    say openssl x509 -req -in "$work/$1.csr" -CA "$folder/ca.pem" -CAkey "$folder/ca.key" -sha256 -days "$days" \
        -set_serial "0x$(openssl rand -hex 16)" -extfile "$work/$1.cnf" -out "$work/$1.pem"
    if [ "$(id -u)" = 0 ]; then chown "$owner" "$work/$1.key"; fi
    bring "$1"
    echo "$folder/$1.pem"
}

names() {
    local found="DNS:$1,DNS:localhost,IP:127.0.0.1" host
    for host in $(echo "${COVISTA_CERTS_HOSTS:-}" | tr ',' ' '); do
        case "$host" in
            *:*) found="$found,IP:$host" ;;
            *[!0-9.]*) found="$found,DNS:$host" ;;
            *) found="$found,IP:$host" ;;
        esac
    done
    echo "$found"
}

for robot in "$@"; do
    # As bash compares, a-z may hold capitals.
    echo "$robot" | LC_ALL=C grep -qxE '[a-z0-9][a-z0-9_-]{0,62}' || fail "$robot is not the id of a robot"
    case "$robot" in ca | station | router) fail "$robot is taken: a robot has a name of its own" ;; esac
done

# Before anything is made.
for name in ca station router "$@"; do pair "$name" || true; done
list="$folder/robots.txt"
if [ -e "$list" ] && [ ! -f "$list" ]; then fail "$list is no file; docker makes a folder where it finds none to mount: remove it"; fi

if [ ! -d "$folder" ]; then
    mkdir -p "$folder"
    # A folder of keys, but containers have to find their way in.
    chmod 755 "$folder"
fi
authority
certificate station serverAuth,clientAuth "$(names station)"
certificate router serverAuth,clientAuth "$(names router)"
if [ ! -e "$list" ]; then
    touch "$list"
    chmod 644 "$list"
fi
for robot in "$@"; do
    # A robot proves who it is to a station, and to nobody that it is one.
    certificate "$robot" clientAuth "DNS:$robot"
    if grep -qxF "$robot" "$list"; then continue; fi
    # Whoever wrote the last line may not have ended it.
    if [ -n "$(tail -c 1 "$list")" ]; then echo >>"$list"; fi
    echo "$robot" >>"$list"
done
