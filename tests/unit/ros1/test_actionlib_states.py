"""States of an actionlib client for any server status, at any time."""

from __future__ import annotations

import itertools

import pytest

from rosglass.comm import GoalStatus
from rosglass.ros1.actionlib import CommState, CommStateMachine, ServerState, TerminalState

LETTERS = {
    "G": CommState.WAITING_FOR_GOAL_ACK,
    "P": CommState.PENDING,
    "A": CommState.ACTIVE,
    "W": CommState.WAITING_FOR_RESULT,
    "C": CommState.WAITING_FOR_CANCEL_ACK,
    "r": CommState.RECALLING,
    "p": CommState.PREEMPTING,
    "D": CommState.DONE,
}
#: actionlib's table: what each state goes through for each status; . for nothing, ! for an error.
TABLE = """
    PENDING ACTIVE REJECTED RECALLING RECALLED PREEMPTED SUCCEEDED ABORTED PREEMPTING
G   P       A      PW       Pr        PW       ApW       AW        AW      Ap
P   .       A      W        r         rW       ApW       AW        AW      Ap
A   !       .      !        !         !        pW        W         W       p
W   !       .      .        !         .        .         .         .       !
C   .       .      W        r         rW       pW        pW        pW      p
r   !       !      W        .         W        pW        pW        pW      p
p   !       !      !        !         !        W         W         W       .
D   !       !      .        !         .        .         .         .       !
"""
_head, *_rows = TABLE.strip().splitlines()
STATUSES = [ServerState[word] for word in _head.split()]
CASES = [
    (LETTERS[row.split()[0]], status, cell)
    for row in _rows
    for status, cell in zip(STATUSES, row.split()[1:], strict=True)
]
#: How to get into each state.
WAYS = {
    CommState.WAITING_FOR_GOAL_ACK: [],
    CommState.PENDING: [ServerState.PENDING],
    CommState.ACTIVE: [ServerState.ACTIVE],
    CommState.WAITING_FOR_RESULT: [ServerState.SUCCEEDED],
    CommState.WAITING_FOR_CANCEL_ACK: ["cancel"],
    CommState.RECALLING: [ServerState.RECALLING],
    CommState.PREEMPTING: [ServerState.PREEMPTING],
    CommState.DONE: ["finish"],
}
NOT_DONE = [state for state in CommState if state is not CommState.DONE]
ENDS = {
    ServerState.RECALLED: (TerminalState.RECALLED, GoalStatus.CANCELED),
    ServerState.REJECTED: (TerminalState.REJECTED, GoalStatus.REJECTED),
    ServerState.PREEMPTED: (TerminalState.PREEMPTED, GoalStatus.CANCELED),
    ServerState.ABORTED: (TerminalState.ABORTED, GoalStatus.ABORTED),
    ServerState.SUCCEEDED: (TerminalState.SUCCEEDED, GoalStatus.SUCCEEDED),
    ServerState.LOST: (TerminalState.LOST, GoalStatus.LOST),
}


def machine(state):
    made = CommStateMachine()
    for step in WAYS[state]:
        if step == "cancel":
            made.cancel()
        elif step == "finish":
            made.on_result(ServerState.SUCCEEDED)
        else:
            made.on_status(step)
    assert made.state is state
    return made


def test_transition_table_is_complete():
    assert len(CASES) == len(CommState) * (len(ServerState) - 1)
    assert set(WAYS) == set(CommState)


@pytest.mark.parametrize(("state", "said", "cell"), CASES)
def test_each_status_in_each_state(state, said, cell):
    made = machine(state)
    heard = made.heard
    if cell == "!":
        with pytest.raises(ValueError, match=f"{said.name} does not follow {state.name}"):
            made.on_status(said)
        assert (made.state, made.heard) == (state, heard)
        return
    steps = made.on_status(said)
    expected = [] if cell == "." else [LETTERS[letter] for letter in cell]
    assert [step.state for step in steps] == expected
    assert made.state is (expected[-1] if expected else state)
    assert made.terminal is (TerminalState.SUCCEEDED if state is CommState.DONE else None)


@pytest.mark.parametrize(("state", "said"), list(itertools.product(NOT_DONE, ENDS)))
def test_result_ends_a_goal_in_each_state(state, said):
    made = machine(state)
    steps = made.on_result(said)
    assert steps[-1] == (CommState.DONE, ENDS[said][1])
    assert made.state is CommState.DONE
    assert (made.terminal, made.status) == ENDS[said]
    # A second result, and whatever else comes, changes nothing.
    assert made.on_result(ServerState.ABORTED) == []
    assert made.on_server_lost() == []
    assert made.cancel() == []
    assert made.terminal is ENDS[said][0]


@pytest.mark.parametrize("said", [said for said in ServerState if said not in ENDS])
def test_result_without_an_end_is_refused(said):
    made = machine(CommState.ACTIVE)
    with pytest.raises(ValueError, match="a result with the state"):
        made.on_result(said)
    assert made.state is CommState.ACTIVE


@pytest.mark.parametrize("state", NOT_DONE)
@pytest.mark.parametrize(
    "lose", [CommStateMachine.on_server_lost, lambda m: m.on_status(ServerState.LOST)]
)
def test_goal_is_lost_in_each_state(state, lose):
    made = machine(state)
    assert lose(made) == [(CommState.DONE, GoalStatus.LOST)]
    assert (made.state, made.terminal) == (CommState.DONE, TerminalState.LOST)


@pytest.mark.parametrize("state", CommState)
def test_cancelling_waits_for_the_server_where_it_makes_a_difference(state):
    made = machine(state)
    before = made.status
    waits = state in (CommState.WAITING_FOR_GOAL_ACK, CommState.PENDING, CommState.ACTIVE)
    steps = [CommState.WAITING_FOR_CANCEL_ACK] if waits else []
    assert [step.state for step in made.cancel()] == steps
    assert made.status is before  # until the server acknowledges it


@pytest.mark.parametrize(
    ("state", "status"),
    [
        (CommState.WAITING_FOR_GOAL_ACK, GoalStatus.PENDING),
        (CommState.PENDING, GoalStatus.PENDING),
        (CommState.ACTIVE, GoalStatus.EXECUTING),
        (CommState.WAITING_FOR_RESULT, GoalStatus.SUCCEEDED),
        (CommState.WAITING_FOR_CANCEL_ACK, GoalStatus.PENDING),
        (CommState.RECALLING, GoalStatus.CANCELING),
        (CommState.PREEMPTING, GoalStatus.CANCELING),
        (CommState.DONE, GoalStatus.SUCCEEDED),
    ],
)
def test_comm_states_map_to_goal_status(state, status):
    assert machine(state).status is status


def test_skipped_states_are_reported_in_order():
    made = CommStateMachine()
    assert made.on_status(ServerState.PREEMPTED) == [
        (CommState.ACTIVE, GoalStatus.EXECUTING),
        (CommState.PREEMPTING, GoalStatus.CANCELING),
        (CommState.WAITING_FOR_RESULT, GoalStatus.CANCELED),
    ]
    assert made.executed


def test_codes_are_those_of_goal_status():
    from rosglass.messages import load

    constants = load("actionlib_msgs/GoalStatus", ros=1).definition.constants
    assert {c.name: c.value for c in constants} == {s.name: int(s) for s in ServerState}
