PRAGMA foreign_keys=OFF;
BEGIN TRANSACTION;
CREATE TABLE alembic_version (
	version_num VARCHAR(32) NOT NULL, 
	CONSTRAINT alembic_version_pkc PRIMARY KEY (version_num)
);
INSERT INTO alembic_version VALUES('0001');
CREATE TABLE studies (
	name VARCHAR(200) NOT NULL, 
	visits_begun INTEGER NOT NULL, 
	CONSTRAINT pk_studies PRIMARY KEY (name)
);
INSERT INTO studies VALUES('demo',2);
CREATE TABLE rounds (
	id INTEGER NOT NULL, 
	study VARCHAR(200) NOT NULL, 
	round_no INTEGER NOT NULL, 
	layout VARCHAR(200) NOT NULL, 
	layout_json TEXT NOT NULL, 
	horizon_ticks INTEGER NOT NULL, 
	tick_ms INTEGER NOT NULL, 
	seed VARCHAR(64) NOT NULL, 
	status VARCHAR(20) NOT NULL, 
	score INTEGER, 
	deliveries INTEGER, 
	final_sha256 VARCHAR(64), 
	created_ms BIGINT NOT NULL, 
	ended_ms BIGINT, 
	CONSTRAINT pk_rounds PRIMARY KEY (id), 
	CONSTRAINT fk_rounds_study FOREIGN KEY(study) REFERENCES studies (name)
);
INSERT INTO rounds VALUES(1,'demo',1,'tiny','{"name": "tiny", "title": "", "aliases": [], "source": "", "grid": ["XXPXX", "O  2O", "X1  X", "XDXSX"], "rules": {"rule_set": "classic", "cook_time_ticks": 20, "delivery_reward": 20, "horizon_ticks": 40, "orders": null}}',40,50,'9223372036854775813','finished',20,1,'bf9fb762ef205a8ed331f6afc8c6b58e2732e204b144a234bf711fd229bf949e',1760000000000,1760000002000);
INSERT INTO rounds VALUES(2,'demo',2,'tiny','{"name": "tiny", "title": "", "aliases": [], "source": "", "grid": ["XXPXX", "O  2O", "X1  X", "XDXSX"], "rules": {"rule_set": "classic", "cook_time_ticks": 20, "delivery_reward": 20, "horizon_ticks": 40, "orders": null}}',40,50,'9223372036854775813','open',NULL,NULL,NULL,1760000000000,NULL);
CREATE TABLE visits (
	id INTEGER NOT NULL, 
	token VARCHAR(64) NOT NULL, 
	participant VARCHAR(32) NOT NULL, 
	study VARCHAR(200) NOT NULL, 
	study_sha256 VARCHAR(64) NOT NULL, 
	visit_no INTEGER NOT NULL, 
	seed VARCHAR(64) NOT NULL, 
	plan_json TEXT NOT NULL, 
	condition TEXT NOT NULL, 
	link_params TEXT NOT NULL, 
	step_index INTEGER NOT NULL, 
	status VARCHAR(20) NOT NULL, 
	completion_code VARCHAR(200), 
	created_ms BIGINT NOT NULL, 
	ended_ms BIGINT, 
	CONSTRAINT pk_visits PRIMARY KEY (id), 
	CONSTRAINT fk_visits_study FOREIGN KEY(study) REFERENCES studies (name), 
	CONSTRAINT uq_visits_study_visit_no UNIQUE (study, visit_no), 
	CONSTRAINT uq_visits_token UNIQUE (token)
);
INSERT INTO visits VALUES(1,'0nRHQqoe4FIUUI3nse5g4C74n6ssW1nK','p3hhtmvorel6vekin','demo','dddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddd',0,'18446744073709551615','{"study":"demo","study_sha256":"dddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddd","visit_no":0,"visit_seed":7,"condition":{"arm":"a"},"hats":{"chef-a":"orange","chef-b":"yellow"},"steps":[{"id":"consent","kind":"consent","title":"Consent","data":{"text":"consent","sha256":"cccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccc"}},{"id":"tutorial","kind":"round","title":"Practice","data":{"round_no":0,"of":2,"layout":"tiny","agent":"chef-a","human_seat":1,"human_hat":"blue","partner_hat":"orange","seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":null,"tutorial":true,"scored":true,"skippable":false}},{"id":"rounds-1","kind":"round","title":"Round 1","data":{"round_no":1,"of":2,"layout":"tiny","agent":"chef-a","human_seat":1,"human_hat":"blue","partner_hat":"orange","seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":{"score":20,"text":"Serve one soup"},"tutorial":false,"scored":true,"skippable":false}},{"id":"rounds-1-questions","kind":"questionnaire","title":"After","data":{"questionnaire":"after","round_no":1,"partner_hat":"orange","human_hat":"blue"}},{"id":"rounds-2","kind":"round","title":"Round 2","data":{"round_no":2,"of":2,"layout":"tiny","agent":"chef-b","human_seat":0,"human_hat":"blue","partner_hat":"yellow","seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":{"score":20,"text":"Serve one soup"},"tutorial":false,"scored":true,"skippable":false}},{"id":"comparison","kind":"comparison","title":"Compare","data":{"questionnaire":"compare","human_hat":"blue","first":{"hat":"orange","agent":"chef-a"},"second":{"hat":"yellow","agent":"chef-b"}}},{"id":"debrief","kind":"debrief","title":"Thank you","data":{"completion_code":"DONE"}}]}','{"arm": "a"}','{"PROLIFIC_PID": "5f"}',4,'active',NULL,1760000000000,NULL);
INSERT INTO visits VALUES(2,'R76q8pLJGxTiSRRbNiY3bDB1mncbl9dw','p72ahsvr34z6no5by','demo','dddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddd',1,'18446744073709551615','{"study":"demo","study_sha256":"dddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddddd","visit_no":1,"visit_seed":7,"condition":{"arm":"a"},"hats":{"chef-a":"orange","chef-b":"yellow"},"steps":[{"id":"consent","kind":"consent","title":"Consent","data":{"text":"consent","sha256":"cccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccccc"}},{"id":"tutorial","kind":"round","title":"Practice","data":{"round_no":0,"of":2,"layout":"tiny","agent":"chef-a","human_seat":1,"human_hat":"blue","partner_hat":"orange","seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":null,"tutorial":true,"scored":true,"skippable":false}},{"id":"rounds-1","kind":"round","title":"Round 1","data":{"round_no":1,"of":2,"layout":"tiny","agent":"chef-a","human_seat":1,"human_hat":"blue","partner_hat":"orange","seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":{"score":20,"text":"Serve one soup"},"tutorial":false,"scored":true,"skippable":false}},{"id":"rounds-1-questions","kind":"questionnaire","title":"After","data":{"questionnaire":"after","round_no":1,"partner_hat":"orange","human_hat":"blue"}},{"id":"rounds-2","kind":"round","title":"Round 2","data":{"round_no":2,"of":2,"layout":"tiny","agent":"chef-b","human_seat":0,"human_hat":"blue","partner_hat":"yellow","seed":9223372036854775813,"ticks":40,"tick_ms":50,"goal":{"score":20,"text":"Serve one soup"},"tutorial":false,"scored":true,"skippable":false}},{"id":"comparison","kind":"comparison","title":"Compare","data":{"questionnaire":"compare","human_hat":"blue","first":{"hat":"orange","agent":"chef-a"},"second":{"hat":"yellow","agent":"chef-b"}}},{"id":"debrief","kind":"debrief","title":"Thank you","data":{"completion_code":"DONE"}}]}','{"arm": "a"}','{}',0,'active',NULL,1760000000000,NULL);
CREATE TABLE clocks (
	round_id INTEGER NOT NULL, 
	seat SMALLINT NOT NULL, 
	server_ms FLOAT NOT NULL, 
	client_ms FLOAT NOT NULL, 
	rtt_ms FLOAT, 
	CONSTRAINT pk_clocks PRIMARY KEY (round_id, seat, server_ms), 
	CONSTRAINT fk_clocks_round_id FOREIGN KEY(round_id) REFERENCES rounds (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO clocks VALUES(1,1,1760000000008.0,11.0,NULL);
CREATE TABLE keys (
	round_id INTEGER NOT NULL, 
	seat SMALLINT NOT NULL, 
	arrival_ms FLOAT NOT NULL, 
	seq INTEGER NOT NULL, 
	"key" VARCHAR(20) NOT NULL, 
	down BOOLEAN NOT NULL, 
	client_ms FLOAT NOT NULL, 
	tick_applied INTEGER, 
	CONSTRAINT pk_keys PRIMARY KEY (round_id, seat, arrival_ms, seq), 
	CONSTRAINT fk_keys_round_id FOREIGN KEY(round_id) REFERENCES rounds (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO keys VALUES(1,1,1760000000007.2499999,1,'up',1,10.499999999999999999,0);
CREATE TABLE pauses (
	round_id INTEGER NOT NULL, 
	started_ms FLOAT NOT NULL, 
	ended_ms FLOAT, 
	tick INTEGER NOT NULL, 
	reason VARCHAR(40) NOT NULL, 
	CONSTRAINT pk_pauses PRIMARY KEY (round_id, started_ms), 
	CONSTRAINT fk_pauses_round_id FOREIGN KEY(round_id) REFERENCES rounds (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO pauses VALUES(1,1760000000150.0,1760000000650.0,3,'left');
CREATE TABLE responses (
	visit_id INTEGER NOT NULL, 
	step_id VARCHAR(200) NOT NULL, 
	item VARCHAR(200) NOT NULL, 
	position INTEGER NOT NULL, 
	value TEXT NOT NULL, 
	shown TEXT NOT NULL, 
	at_ms BIGINT NOT NULL, 
	CONSTRAINT pk_responses PRIMARY KEY (visit_id, step_id, item), 
	CONSTRAINT fk_responses_visit_id FOREIGN KEY(visit_id) REFERENCES visits (id) ON DELETE CASCADE
);
INSERT INTO responses VALUES(1,'rounds-1-questions','ease',1,'5','{"id": "ease", "text": "Easy?", "help": "", "required": true, "when": null, "scale": 7, "low_label": "no", "high_label": "yes", "labels": [], "kind": "likert", "style": "radio", "expected": null}',1760000003000);
INSERT INTO responses VALUES(1,'rounds-1-questions','why',2,'"=1+1"','{"id": "why", "text": "Why?", "help": "", "required": true, "when": null, "kind": "long_text", "max_length": 5000}',1760000003000);
CREATE TABLE seats (
	round_id INTEGER NOT NULL, 
	seat SMALLINT NOT NULL, 
	visit_id INTEGER, 
	step_id VARCHAR(200), 
	agent VARCHAR(200), 
	agent_sha256 VARCHAR(64), 
	hat VARCHAR(40), 
	CONSTRAINT pk_seats PRIMARY KEY (round_id, seat), 
	CONSTRAINT fk_seats_round_id FOREIGN KEY(round_id) REFERENCES rounds (id) ON DELETE CASCADE, 
	CONSTRAINT fk_seats_visit_id FOREIGN KEY(visit_id) REFERENCES visits (id) ON DELETE CASCADE, 
	CONSTRAINT uq_seats_visit_id_step_id UNIQUE (visit_id, step_id)
);
INSERT INTO seats VALUES(1,1,1,'rounds-1',NULL,NULL,NULL);
INSERT INTO seats VALUES(1,0,NULL,NULL,'chef-a','aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa','orange');
INSERT INTO seats VALUES(2,0,2,'rounds-2',NULL,NULL,NULL);
INSERT INTO seats VALUES(2,1,NULL,NULL,'chef-b','aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa','yellow');
CREATE TABLE stages (
	visit_id INTEGER NOT NULL, 
	step_id VARCHAR(200) NOT NULL, 
	entered_ms BIGINT NOT NULL, 
	left_ms BIGINT, 
	views INTEGER NOT NULL, 
	CONSTRAINT pk_stages PRIMARY KEY (visit_id, step_id), 
	CONSTRAINT fk_stages_visit_id FOREIGN KEY(visit_id) REFERENCES visits (id) ON DELETE CASCADE
);
INSERT INTO stages VALUES(1,'consent',1760000000000,1760000000900,1);
INSERT INTO stages VALUES(1,'rounds-1-questions',1760000003000,1760000003000,0);
CREATE TABLE ticks (
	round_id INTEGER NOT NULL, 
	tick INTEGER NOT NULL, 
	action_0 SMALLINT NOT NULL, 
	action_1 SMALLINT NOT NULL, 
	deadline_ms FLOAT NOT NULL, 
	lateness_ms FLOAT NOT NULL, 
	decision_ms FLOAT, 
	late BOOLEAN NOT NULL, 
	fault VARCHAR(40), 
	CONSTRAINT pk_ticks PRIMARY KEY (round_id, tick), 
	CONSTRAINT fk_ticks_round_id FOREIGN KEY(round_id) REFERENCES rounds (id) ON DELETE CASCADE
)
 WITHOUT ROWID

;
INSERT INTO ticks VALUES(1,0,0,4,1760000000000.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,1,3,4,1760000000050.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,2,5,4,1760000000100.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,3,2,4,1760000000150.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,4,0,4,1760000000200.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,5,5,4,1760000000250.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,6,3,4,1760000000300.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,7,5,4,1760000000350.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,8,2,4,1760000000400.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,9,0,4,1760000000450.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,10,5,4,1760000000500.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,11,3,4,1760000000550.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,12,5,4,1760000000600.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,13,2,4,1760000000650.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,14,0,4,1760000000700.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,15,5,4,1760000000750.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,16,3,4,1760000000800.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,17,1,4,1760000000850.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,18,1,4,1760000000900.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,19,5,4,1760000000950.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,20,0,4,1760000001000.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,21,2,4,1760000001050.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,22,0,4,1760000001100.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,23,4,4,1760000001150.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,24,4,4,1760000001200.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,25,4,4,1760000001250.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,26,4,4,1760000001300.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,27,4,4,1760000001350.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,28,4,4,1760000001400.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,29,4,4,1760000001450.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,30,4,4,1760000001500.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,31,4,4,1760000001550.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,32,4,4,1760000001600.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,33,4,4,1760000001650.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,34,4,4,1760000001700.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,35,5,4,1760000001750.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,36,1,4,1760000001800.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,37,2,4,1760000001850.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,38,1,4,1760000001900.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(1,39,5,4,1760000001950.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,0,4,0,1760000000000.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,1,1,1,1760000000050.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,2,1,4,1760000000100.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,3,5,3,1760000000150.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,4,0,0,1760000000200.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,5,1,2,1760000000250.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,6,3,2,1760000000300.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,7,1,0,1760000000350.0,0.5,3.25,0,NULL);
INSERT INTO ticks VALUES(2,8,4,4,1760000000400.0,0.5,3.25,0,NULL);
CREATE INDEX ix_rounds_study ON rounds (study);
CREATE INDEX ix_visits_participant ON visits (participant);
COMMIT;
