"""The studio in a cell of a notebook: its page in a frame, answered by the kernel, both ways."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import anywidget
import traitlets

from trunnion.model.file import entries_of, text_of
from trunnion.model.mechanism import Mechanism
from trunnion.studio.answers import answer
from trunnion.studio.page import found, one_file

NAME = "mechanism.yaml"


class StudioWidget(anywidget.AnyWidget):
    """A mechanism that is drawn and dragged in a cell.

    Parameters
    ----------
    text : str
        The model as YAML; it follows what is done in the cell.
    height : int
        Of the cell, px.
    """

    _esm = traitlets.Unicode(found("studio", "cell.js").read_text("utf-8")).tag(sync=True)
    height = traitlets.Int(720).tag(sync=True)

    def __init__(self, text: str, height: int = 720) -> None:
        """Show a text."""
        super().__init__(height=height)
        self.text = text
        self.on_msg(self._asked)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism as it is in the cell now; MechanismError if it is not sound, as one that is half drawn."""
        return Mechanism(**entries_of(self.text)[0])

    def _asked(self, _widget: Any, message: Mapping[str, Any], buffers: list[Any]) -> None:
        """Answer the page: with itself, to a question as the server does, or as a folder of one file."""
        if message.get("page"):
            self.send({"page": one_file()})
            return
        if message.get("question") is not None:
            question = str(message["question"])
            asked = json.loads(question)
            if asked.get("ask") in ("model", "edit") and isinstance(asked.get("text"), str):
                self.text = asked["text"]
            status, body = 200, answer(question.encode())
        else:
            # what the server answers of its files and studies: a folder of one file, and no studies
            kind, sent = str(message.get("path")).strip("/").partition("/")[0], bytes(buffers[0]) if buffers else b""
            status, reply = 200, dict[str, Any]()
            if kind == "files":
                digest = hashlib.sha256(self.model_id.encode()).hexdigest()[:16]
                reply = {"folder": "notebook", "id": digest, "open": NAME, "files": [NAME]}
            elif kind == "file":
                self.text = str(json.loads(sent)["text"]) if sent else self.text
                reply = {"saved": NAME} if sent else {"text": self.text}
            elif kind == "jobs":
                reply = {"forms": [], "jobs": []}
            else:
                status, reply = 404, {"error": "A notebook does not do that: use the command line."}
            body = json.dumps(reply).encode()
        self.send({"id": message["id"], "status": status}, [body])


def studio(mechanism: Mechanism, height: int = 720) -> StudioWidget:
    """The studio on a mechanism, for a cell of a notebook."""
    return StudioWidget(text_of(mechanism.data()), height)
