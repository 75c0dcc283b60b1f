"""Calling the master and other nodes: XML-RPC with time-outs, and answers that are checked.

APIs: ROS wiki, "ROS/Master_API", "ROS/Parameter Server API", "ROS/Slave_API": each answer is
``[code, status message, value]``, the code 1 for success.
"""

from __future__ import annotations

import http.client
import socket
import xmlrpc.client
from typing import Any
from xml.parsers.expat import ExpatError

from rosglass.errors import ConnectionLostError, MasterError

__all__ = ["Master", "call_node", "reason_of"]

#: Seconds that somebody may take to answer.
_TIMEOUT = 5.0
_SUCCESS = 1


class _Transport(xmlrpc.client.Transport):
    """HTTP with a time-out."""

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        made = super().make_connection(host)
        made.timeout = self._timeout
        return made


def call_node(uri: str, method: str, *arguments: Any, timeout: float = _TIMEOUT) -> Any:
    """Call a method of a node or the master and return the value it answers.

    Raises:
        ConnectionLostError: Nobody answers there, or what is no ROS.
        MasterError: The answer is that it failed.
    """
    try:
        with xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout)) as proxy:
            answer: Any = getattr(proxy, method)(*arguments)
    except (OSError, http.client.HTTPException) as error:
        raise ConnectionLostError(f"{uri} does not answer: {reason_of(error)}") from error
    except xmlrpc.client.Fault as error:
        raise MasterError(f"{uri} failed at {method}: {error.faultString}") from error
    except (xmlrpc.client.Error, ExpatError, ValueError, TypeError) as error:
        raise ConnectionLostError(f"{uri} answers, but not as ROS 1 does: {error}") from error
    shape = isinstance(answer, (list, tuple)) and len(answer) == 3
    if not shape or type(answer[0]) is not int:
        raise ConnectionLostError(f"{uri} answers, but not as ROS 1 does: {answer!r:.80}")
    code, message, value = answer
    if code != _SUCCESS:
        raise MasterError(f"{uri} refuses {method}: {message}")
    return value


def reason_of(error: BaseException) -> str:
    """Return an error of the network in a few words."""
    if isinstance(error, socket.gaierror):
        return "its host name is not known on this machine"
    if isinstance(error, TimeoutError):
        return "no answer in time"
    return getattr(error, "strerror", None) or str(error) or type(error).__name__


class Master:
    """The master's APIs, called as one node; each call waits for its answer.

    Args:
        uri: The master's, such as ``http://robot:11311``.
        caller: The node's full name.
    """

    def __init__(self, uri: str, caller: str) -> None:
        self.uri, self.caller = uri, caller

    def call(self, method: str, *arguments: Any, timeout: float = _TIMEOUT) -> Any:
        """Call a method, the node's name in front; errors as of :func:`call_node`."""
        return call_node(self.uri, method, self.caller, *arguments, timeout=timeout)
