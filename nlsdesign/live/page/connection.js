// The socket to the session of this tab. The token stands behind the # of the address, which a browser sends
// nowhere; it goes into the storage of the tab and out of the address at once.

const kept = {
  get(name) { try { return sessionStorage.getItem(name) ?? ""; } catch { return ""; } },
  set(name, value) { try { sessionStorage.setItem(name, value); } catch { /* then for this load only */ } },
};
let token = kept.get("token");
let session = kept.get("session");

const given = /^#token=([\w-]+)$/.exec(location.hash);
if (given) {
  if (given[1] !== token) session = "";
  token = given[1];
  kept.set("token", token);
  history.replaceState(null, "", "/");
}

// A new address that is pasted into this tab changes nothing but what stands behind the #.
window.addEventListener("hashchange", () => { if (/^#token=[\w-]+$/.test(location.hash)) location.reload(); });

export class Connection {
  // receive(message) takes what the server says; state(words, lost) how the connection stands.
  constructor(receive, state) {
    this.receive = receive;
    this.state = state;
    this.pause = 200;
    this.over = false;
    this.open();
  }

  open() {
    if (!token) {
      this.state("Open the address that “nlsdesign serve” has printed: its token is missing here.", true);
      return;
    }
    const query = session ? `?session=${encodeURIComponent(session)}` : "";
    this.socket = new WebSocket(`ws://${location.host}/api/design${query}`, ["nlsdesign", token]);
    this.socket.addEventListener("open", () => { this.pause = 200; this.opened = true; this.state("", false); });
    this.socket.addEventListener("message", (event) => this.take(JSON.parse(event.data)));
    this.socket.addEventListener("close", () => this.closed());
  }

  take(message) {
    if (message.what === "session") {
      session = message.session;
      kept.set("session", session);
    } else if (message.what === "elsewhere") {
      this.over = true;
      this.state("This design is shown in another tab. Load this page again to have it here.", true);
      this.socket.close();
      return;
    } else if (message.what === "ended") {
      this.over = true;
      session = "";
      kept.set("session", "");
      this.state(`The session has ended: ${message.reason}. Load the page again to begin anew.`, true);
      return;
    }
    this.receive(message);
  }

  closed() {
    if (this.over) return;
    this.state(this.opened
      ? "The connection is lost; trying again. If “nlsdesign serve” was started anew, open the address that it has printed."
      : "Nothing answers, or the token is of an earlier run: open the address that “nlsdesign serve” has printed.", true);
    setTimeout(() => this.open(), this.pause);
    this.pause = Math.min(5000, 2 * this.pause);
  }

  get live() {
    return !this.over && this.socket?.readyState === WebSocket.OPEN;
  }

  send(message) {
    if (!this.live) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }
}

function headers() {
  return { "Authorization": `Bearer ${token}`, "X-Session": session };
}

async function words(response) {
  const text = (await response.text()).slice(0, 600);
  return text || `the server answered ${response.status}`;
}

// Returns what went wrong in words, or "".
export async function upload(path, body) {
  try {
    const response = await fetch(path, { method: "POST", headers: headers(), body });
    return response.ok ? "" : await words(response);
  } catch {
    return "the file was not taken: the connection broke off";
  }
}

export async function download(kind) {
  try {
    const response = await fetch(`/api/file/${encodeURIComponent(kind)}`, { method: "POST", headers: headers() });
    if (!response.ok) return await words(response);
    const name = /filename="([^"]+)"/.exec(response.headers.get("content-disposition") ?? "")?.[1] ?? "file";
    const place = URL.createObjectURL(await response.blob());
    const link = document.createElement("a");
    link.href = place;
    link.download = name;
    document.body.append(link);
    link.click();
    link.remove();
    setTimeout(() => URL.revokeObjectURL(place), 10000);
    return "";
  } catch {
    return "the file did not come: the connection broke off";
  }
}
