# Galley for serving: CPU only, without the extras that train agents. See docs/scaling-out.md.
FROM python:3.12-slim AS build
WORKDIR /source
COPY pyproject.toml README.md LICENSE ./
COPY backend ./backend
COPY frontend ./frontend
COPY layouts ./layouts
COPY agents ./agents
COPY questionnaires ./questionnaires
COPY studies ./studies
RUN python -m venv /opt/galley \
 && /opt/galley/bin/pip install --no-cache-dir '.[postgres]'

FROM python:3.12-slim
COPY --from=build /opt/galley /opt/galley
ENV PATH=/opt/galley/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    HOST=0.0.0.0 \
    PORT=8000 \
    NUMBA_CACHE_DIR=/var/cache/galley
# Another workspace is mounted over /workspace; what is written goes to /data and the cache alone.
RUN useradd --system --uid 10001 --home-dir /data --shell /usr/sbin/nologin galley \
 && mkdir -p /data /var/cache/galley \
 && chown galley:galley /data /var/cache/galley \
 && galley init /workspace
USER galley
WORKDIR /data
ENV DATABASE=sqlite:////data/galley.sqlite
VOLUME /data
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=5s --timeout=3s --start-period=180s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request; urllib.request.urlopen(f'http://127.0.0.1:{os.environ[\"PORT\"]}/healthz', timeout=2)"]
CMD ["galley", "serve", "/workspace"]
