// Begin: take the token of the address, open the session, follow its events.

async function begin() {
  followSystemTheme();
  const token = takenToken();
  const say = (text) => {
    byId("gone-text").textContent = text;
    byId("gone").hidden = false;
  };
  if (!token) return say("No token in the address: open the page by the file that cellplan edit names in the terminal.");
  let app = null;
  const early = []; // events from before the page is made
  const client = new Client(token, {
    answer: (answer) => app.apply(answer),
    event: (event) => (app ? app.outcome.take(event) : early.push(event)),
    refused: (text) => (app ? app.refused(text) : say(text)),
    gone: () => {
      const text = "The session of cellplan edit has ended or does not answer. What was changed stands below: paste it behind the command.";
      if (app) app.leave(text);
      else if (byId("gone").hidden) say(text);
    },
  });
  await new Promise((opened) => client.follow(opened).then(opened));
  if (client.isGone) return undefined;
  await client.guarded(async () => {
    app = window.app = new LiveApp(await client.record("/open", {}), client);
  });
  if (app) early.forEach((event) => app.outcome.take(event));
  return undefined;
}

begin();
