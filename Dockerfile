# er3a with its locked, hash-checked packages.
#   docker build -t er3a .
#   docker run --rm -v "$PWD:/study" er3a run --study config/small.yaml -- --cores 2
FROM docker.io/library/debian:bookworm-slim
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-venv \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home --uid 1000 er3a \
    && install --directory --owner er3a /study
COPY requirements/run.txt /opt/er3a/requirements/
RUN python3 -m venv /opt/er3a/venv \
    && /opt/er3a/venv/bin/python -m pip install --no-cache-dir --require-hashes -r /opt/er3a/requirements/run.txt
COPY . /opt/er3a/source
RUN /opt/er3a/venv/bin/python -m pip install --no-cache-dir --no-deps --no-build-isolation --no-index /opt/er3a/source \
    && rm -r /opt/er3a/source
ENV PATH=/opt/er3a/venv/bin:$PATH
USER er3a
WORKDIR /study
ENTRYPOINT ["er3a"]
