"""Validates the crates of folders of results: `validate_crates.py FOLDER...`.

The judge is rocrate_validator (CRS4) with its profile of Workflow Run Crates and all that this inherits from:
Process Run Crate, Workflow RO-Crate, RO-Crate 1.1. It runs in its offline mode: the one document that a crate
leads to, the JSON-LD context of RO-Crate 1.1, comes from the package rocrate. ro-crate-py then opens the crate.

Prints one JSON object per folder: requirements and recommendations that are not met, and what ro-crate-py found.
"""

import importlib.resources
import io
import json
import sys
import tempfile
from pathlib import Path

import urllib3
from requests.adapters import HTTPAdapter
from requests_cache import CachedSession
from rocrate.rocrate import ROCrate
from rocrate_validator import services
from rocrate_validator.models import Severity, ValidationSettings

CONTEXT = "https://w3id.org/ro/crate/1.1/context"


class FromPackage(HTTPAdapter):
    """Answers with the context that rocrate ships, whatever the network is like."""

    def send(self, request, **_):
        text = importlib.resources.files("rocrate").joinpath("data/ro-crate.jsonld").read_bytes()
        assert json.loads(text)["@id"] == CONTEXT, "rocrate ships another context"
        assert request.url == CONTEXT, request.url
        answer = urllib3.HTTPResponse(
            body=io.BytesIO(text),
            headers={"Content-Type": "application/ld+json"},
            status=200,
            preload_content=False,
            request_url=request.url,
        )
        return self.build_response(request, answer)


def fill(cache):
    """Puts the context where the validator looks for it."""
    with CachedSession(cache_name=str(cache), backend="sqlite", expire_after=-1) as session:
        session.mount("https://", FromPackage())
        assert session.get(CONTEXT).status_code == 200


def issues(folder, cache):
    settings = ValidationSettings(
        rocrate_uri=str(folder),
        profile_identifier="workflow-run-crate",
        requirement_severity=Severity.RECOMMENDED,
        cache_path=cache,
        offline=True,
    )
    result = services.validate(settings)
    found = {"required": set(), "recommended": set()}
    for issue in result.get_issues(Severity.RECOMMENDED):
        kind = "required" if issue.severity >= Severity.REQUIRED else "recommended"
        found[kind].add(f"{issue.check.identifier}: {issue.message}")
    return {kind: sorted(texts) for kind, texts in found.items()}


def main():
    with tempfile.TemporaryDirectory() as temporary:
        cache = Path(temporary) / "cache"
        fill(cache)
        for folder in sys.argv[1:]:
            found = issues(folder, cache)
            if not found["required"]:
                crate = ROCrate(folder)
                found["main"] = crate.mainEntity.id
                found["parts"] = [part["@id"] for part in crate.root_dataset["hasPart"]]
            print(json.dumps(found))


main()
