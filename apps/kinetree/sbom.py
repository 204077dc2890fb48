"""sbom.py OUT VERSION DATE [NAME=VERSION...]: the software bill of materials in SPDX 2.3, as JSON.

Kinetree has no code of others. The bill lists the libraries that the command and the libraries of this build load, with their
licences, so that whoever ships a build has the list at hand. Equal builds have equal bills.
"""
# SPDX-License-Identifier: Apache-2.0
import hashlib
import json
import sys

LICENCES = {"OpenBLAS": "BSD-3-Clause", "LAPACKE": "BSD-3-Clause", "libyaml": "MIT", "expat": "MIT", "jansson": "MIT", "cairo": "LGPL-2.1-only OR MPL-1.1",
            "HDF5": "BSD-3-Clause-LBNL", "minizip": "Zlib", "assimp": "BSD-3-Clause"}


def package(name, version, licence):
    return {"SPDXID": f"SPDXRef-{name}", "name": name, "versionInfo": version, "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
            "licenseConcluded": licence, "licenseDeclared": licence, "copyrightText": "NOASSERTION"}


def bill(version, date, libraries):
    ours = package("Kinetree", version, "Apache-2.0") | {"copyrightText": "The Kinetree developers"}
    packages = [ours] + [package(name, found, LICENCES.get(name, "NOASSERTION")) for name, found in libraries]
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", ours)] + [(ours["SPDXID"], "DEPENDS_ON", one) for one in packages[1:]]
    content = hashlib.sha256(json.dumps(packages).encode()).hexdigest()[:32]
    return {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"kinetree-{version}",
            "documentNamespace": f"https://spdx.org/spdxdocs/kinetree-{version}-{content}",
            "creationInfo": {"created": f"{date}T00:00:00Z", "creators": ["Organization: The Kinetree developers", "Tool: sbom.py"]},
            "packages": packages,
            "relationships": [{"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b["SPDXID"]} for a, kind, b in relations]}


out, version, date, *libraries = sys.argv[1:]
with open(out, "w", encoding="utf-8") as file:
    json.dump(bill(version, date, [one.split("=", 1) for one in libraries]), file, indent=2)
    file.write("\n")
