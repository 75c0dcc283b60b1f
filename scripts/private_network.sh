#!/usr/bin/env bash
# Runs a command in a network of its own: scripts/private_network.sh COMMAND [ARGUMENT...]
# DDS nodes find everyone they can reach; here they reach only what the command starts.
# Where that is not permitted, the command runs in the machine's own network.
set -euo pipefail
PATH=$PATH:/usr/sbin:/sbin
ready='ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo'
# As root; otherwise as root of a user namespace.
for kind in -n -rn; do
  if unshare "$kind" sh -c "$ready" 2>/dev/null; then
    exec unshare "$kind" sh -c "$ready && ROSGLASS_PRIVATE_NETWORK=1 exec \"\$@\"" sh "$@"
  fi
done
echo "==> no private network is permitted here (unshare, ip): using this machine's own" >&2
exec "$@"
