"""A certificate: what is proved of one observer, with all numbers of the proof, as a JSON file.

A stranger can read the file and check it again. It begins alike for every proof; only the numbers differ.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from ....foundation.errors import MeasurementError
from ....foundation.text_files import write_text
from ....model import FlatModel

FORMAT = "nlsdesign observer certificate 1"
CERTIFICATE = "certificate.json"
"""Name of the file beside the C code."""


class Proof(Protocol):
    """What is proved, with its numbers."""

    form: ClassVar[str]
    """Format of its file."""
    sampled: ClassVar[bool]
    """Whether the proof is one of an observer that runs as C code."""

    @property
    def statement(self) -> tuple[str, ...]:
        """Sentences on what is proved, and what is not."""
        ...

    def observer(self) -> dict[str, Any]:
        """Return what a file says of the observer beside the names of its torque and angle."""
        ...

    def numbers(self) -> dict[str, Any]:
        """Return the numbers of the proof as JSON holds them."""
        ...


ProofT = TypeVar("ProofT", bound=Proof, covariant=True)


@dataclass(frozen=True, eq=False)
class Certificate(Generic[ProofT]):
    """What is proved of one observer.

    Parameters
    ----------
    deck
        Name and text of the deck; empty where the model came from elsewhere.
    parameters
        Values of the model by name.
    estimate, measured
        Torque and angle by name.
    proof
        What is proved, with its numbers.
    code
        SHA-256 of the C files by name; empty where none were written.
    """

    deck: tuple[str, str]
    parameters: Mapping[str, float]
    estimate: str
    measured: str
    proof: ProofT
    code: Mapping[str, str] = field(default_factory=dict)

    @property
    def statement(self) -> tuple[str, ...]:
        """Return in sentences what is proved, and what is not."""
        return self.proof.statement

    def stated(self, observer: FlatModel) -> FlatModel:
        """Return an observer whose description, and so the head of its C code, ends with what is proved.

        Parameters
        ----------
        observer
            As designed.
        """
        text = f"{observer.description}; certified, see {CERTIFICATE}: {' '.join(self.statement)}"
        return replace(observer, description=text)

    def write_beside(self, *files: Path) -> Path:
        """Write the certificate beside C files, with their hashes.

        Parameters
        ----------
        files
            Sources and headers, in one folder.

        Raises
        ------
        MeasurementError
            If one cannot be read.
        ExportError
            If the certificate cannot be written.
        """
        (folder,) = {file.parent for file in files}
        hashes = hashes_of_code(folder)
        named = replace(self, code={file.name: hashes[file.name] for file in files})
        return write_certificate(named, folder / CERTIFICATE)


def certificate_text(certificate: Certificate[Proof]) -> str:
    """Return the JSON text of a certificate."""
    name, text = certificate.deck
    content: dict[str, Any] = {
        "format": certificate.proof.form,
        "statement": list(certificate.statement),
        "deck": {"name": name, "sha256": hashlib.sha256(text.encode()).hexdigest(), "text": text},
        "parameters": dict(certificate.parameters),
        "observer": {
            "estimate": certificate.estimate,
            "measured": certificate.measured,
            **certificate.proof.observer(),
        },
        **certificate.proof.numbers(),
    }
    if certificate.proof.sampled:
        content["code"] = dict(certificate.code)
    sorted_text = json.dumps(content, sort_keys=True, ensure_ascii=True, separators=(",", ":"))
    content["checksum"] = hashlib.sha256(sorted_text.encode()).hexdigest()
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"


def write_certificate(certificate: Certificate[Proof], path: str | Path) -> Path:
    """Write a certificate as JSON.

    Parameters
    ----------
    certificate
        What is proved.
    path
        Name of the file.

    Raises
    ------
    ExportError
        If the file cannot be written.
    """
    write_text(Path(path), certificate_text(certificate))
    return Path(path)


def hashes_of_code(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each C source and header in a folder, by name."""
    try:
        files = sorted(f for f in folder.iterdir() if f.suffix in (".c", ".h"))
        result = {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in files}
    except OSError as error:
        raise MeasurementError(str(folder), f"cannot be read ({error.strerror or error})") from None
    if not result:
        raise MeasurementError(str(folder), "has no C files")
    return result
