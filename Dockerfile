# An environment with voroquad and what renders need:
#     docker build -t voroquad . && docker run --rm voroquad integrate "exp(x*y)" --bounds 0:1,0:1
FROM python:3.12-slim-trixie AS build
RUN apt-get update && apt-get install -y --no-install-recommends g++ make
COPY . /source
WORKDIR /source
# The live figure is made with the package, and then is part of it
RUN make wasm LEVELS=this-machine && test -s src/voroquad/report/live.html && \
    .venv/bin/pip wheel --no-build-isolation --no-deps -C cmake.define.VOROQUAD_LEVELS=all -w /wheels .

FROM python:3.12-slim-trixie
RUN apt-get update && apt-get install -y --no-install-recommends libllvm19 && rm -rf /var/lib/apt/lists/*
COPY --from=build /wheels /wheels
RUN pip install --no-cache-dir "$(echo /wheels/*.whl)[render,explore]" && rm -r /wheels
RUN useradd --create-home voroquad
USER voroquad
WORKDIR /home/voroquad
ENTRYPOINT ["voroquad"]
CMD ["--help"]
