# A PostgreSQL server that trusts whoever reaches its network: for tests alone.
ARG BASE_IMAGE
FROM ${BASE_IMAGE}
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends postgresql >/dev/null
USER postgres
RUN bin=$(echo /usr/lib/postgresql/*/bin) \
    && ln -s "$bin" /var/lib/postgresql/bin \
    && "$bin/initdb" --auth=trust --pgdata=/var/lib/postgresql/data >/dev/null \
    && echo "host all all all trust" >>/var/lib/postgresql/data/pg_hba.conf
CMD ["/var/lib/postgresql/bin/postgres", "-D", "/var/lib/postgresql/data", "-c", "listen_addresses=*"]
