# Image of the rollout workers: the package and Ray, without rendering.
# Build from the repository root: docker build -f deploy/actor.Dockerfile -t inhabit-actor .
FROM python:3.11-slim-bookworm

RUN useradd --create-home --uid 1000 inhabit
WORKDIR /app
# Kubernetes probes of Ray use wget.
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --yes --no-install-recommends wget \
    && rm -rf /var/lib/apt/lists/*

COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY world world
COPY rpc rpc
COPY policy policy
COPY actors actors
COPY discriminator discriminator
COPY learner learner
COPY console console
COPY pretrained pretrained
# The pinned torch first, so that no package pulls a CUDA build.
RUN pip install --no-cache-dir -c constraints.txt torch==2.13.0 \
    && pip install --no-cache-dir -c constraints.txt .

ENV OMP_WAIT_POLICY=PASSIVE RAY_USAGE_STATS_ENABLED=0
USER 1000
