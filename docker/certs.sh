#!/usr/bin/env bash
# Makes what a locked door needs, for trying things out: an authority, and certificates for the station, a router
# and robots. What is there already stays as it is, so robots can be added later:
#
#     docker/certs.sh FOLDER [ROBOT...]
#
# FOLDER gets ca.pem, ca.key, station.pem, station.key, router.pem, router.key, ROBOT.pem and ROBOT.key for each robot,
# and robots.txt, the list of robots that are let in. Keys can be read by their owner only (mode 600); called by root,
# the owner of all but ca.key is uid 10001 (COVISTA_CERTS_UID), which the containers run as.
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

authority() {
    if [ -s "$folder/ca.pem" ] && [ -s "$folder/ca.key" ]; then return; fi
    if [ -e "$folder/ca.pem" ]; then fail "$folder has ca.pem and no ca.key: certificates have to come from elsewhere"; fi
    key "$folder/ca.key"
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
    say openssl req -x509 -new -key "$folder/ca.key" -sha256 -days 3650 -config "$work/ca.cnf" -out "$folder/ca.pem"
}

# NAME, extended usage, subject alternative names
certificate() {
    if [ -s "$folder/$1.pem" ] && [ -s "$folder/$1.key" ]; then return; fi
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
    # Both at once, or none: a certificate without its key would look as if it were there.
    mv "$work/$1.key" "$folder/$1.key"
    mv "$work/$1.pem" "$folder/$1.pem"
    echo "$folder/$1.pem"
}

names() {
    local found="DNS:$1,DNS:localhost,IP:127.0.0.1" host
    for host in $(echo "${COVISTA_CERTS_HOSTS:-}" | tr ',' ' '); do
        case "$host" in
            *[!0-9.:]*) found="$found,DNS:$host" ;;
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

mkdir -p "$folder"
# A folder of keys, but containers have to find their way in.
chmod 755 "$folder"
authority
certificate station serverAuth,clientAuth "$(names station)"
certificate router serverAuth,clientAuth "$(names router)"
touch "$folder/robots.txt"
for robot in "$@"; do
    # A robot proves who it is to a station, and to nobody that it is one.
    certificate "$robot" clientAuth "DNS:$robot"
    grep -qxF "$robot" "$folder/robots.txt" || echo "$robot" >>"$folder/robots.txt"
done
chmod 644 "$folder"/*.pem "$folder/robots.txt"
if [ "$(id -u)" = 0 ]; then
    for name in "$folder"/*.key; do
        [ "$name" = "$folder/ca.key" ] || chown "$owner" "$name"
    done
fi
