# Image of the head, the learner and the services: that of the actors, with rendering.
# Build from the repository root: docker build -f deploy/learner.Dockerfile -t inhabit-learner .
FROM python:3.11-slim-bookworm

RUN useradd --create-home --uid 1000 inhabit
WORKDIR /app
# OpenGL without a screen for `inhabit video` and `report`; wget for Ray's probes.
# hadolint ignore=DL3008
RUN apt-get update && apt-get install --yes --no-install-recommends libosmesa6 wget \
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
    && pip install --no-cache-dir -c constraints.txt '.[export]'

ENV MUJOCO_GL=osmesa OMP_WAIT_POLICY=PASSIVE RAY_USAGE_STATS_ENABLED=0
USER 1000
