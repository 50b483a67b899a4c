# Image of the demo: a furnished room in the browser, on a CPU, with the policies of the package.
# Build from the repository root: docker build -f deploy/demo.Dockerfile -t inhabit-demo .
# Run, then open http://127.0.0.1:8080/:
#   docker run --rm -p 127.0.0.1:8080:8080 inhabit-demo
# With the policies for research only:
#   docker run --rm -p 127.0.0.1:8080:8080 inhabit-demo /app/pretrained/sit /app/pretrained/lie
FROM python:3.11-slim-bookworm

RUN useradd --create-home --uid 1000 inhabit
WORKDIR /app

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

ENV OMP_WAIT_POLICY=PASSIVE PYTHONUNBUFFERED=1
EXPOSE 8080
USER 1000
# Inside the container every address is the container's own: -p decides who reaches it.
ENTRYPOINT ["inhabit", "demo", "--listen", "0.0.0.0:8080", "--allow-insecure-remote", "--no-open"]
